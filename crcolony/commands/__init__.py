"""The commands of `crcolony`, one file each. Heavy imports wait until a command needs them."""
