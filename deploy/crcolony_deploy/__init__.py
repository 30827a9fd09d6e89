"""Deployments: the authority that certifies the members of a colony, enrolment, and what is wrong on a host."""
