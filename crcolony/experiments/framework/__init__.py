"""What every experiment is made of: registered claims, durable rows, statistics, the table of claims."""
