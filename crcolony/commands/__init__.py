"""The commands of `crcolony`, one file each. They import heavy modules only when they run."""
