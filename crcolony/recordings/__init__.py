"""What was heard of colonies, kept: recorded, lived again, told again from a history, or turned into tables."""
