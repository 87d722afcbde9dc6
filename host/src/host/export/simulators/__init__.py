"""An identified aircraft in the forms of other simulators, one file each."""
