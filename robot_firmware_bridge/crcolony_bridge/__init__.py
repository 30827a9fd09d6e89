"""Bodies that are no simulation: drivers of real robots, and the body server that gives them to a colony's robots.

A body knows no mind: nothing here imports learning, evolution or the robot's node.
"""
