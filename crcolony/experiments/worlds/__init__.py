"""Small worlds of experiments, with known optima."""
