"""Deployments: the authority that certifies the members of a colony, enrollment, and what is wrong on a host."""
