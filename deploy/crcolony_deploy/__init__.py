"""Deployments: the authority that certifies the members of a colony, enrolment, revocation, and inventories."""
