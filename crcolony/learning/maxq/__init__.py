"""MAXQ (Dietterich 2000; section 3.4.3 of the thesis): learning by a hierarchy of subtasks."""
