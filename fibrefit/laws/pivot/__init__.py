"""Laws of the pivot of a pendulum, one file each."""
