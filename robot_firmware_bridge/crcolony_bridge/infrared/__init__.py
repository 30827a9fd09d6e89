"""What robots tell each other by infrared."""
