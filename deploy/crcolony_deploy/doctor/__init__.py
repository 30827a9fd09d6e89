"""What is wrong on a host, one line each with the remedy: a file for each check, a table of all in `examine.py`."""
