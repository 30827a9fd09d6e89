"""What differs from board to board, one module each: it is uploaded with the script, and no Python here runs it."""
