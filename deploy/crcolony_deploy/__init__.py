"""Deployments: the authority of a colony, enrolment, revocation, what is wrong on a host, metrics, and an audit log."""
