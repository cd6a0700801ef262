"""Compiled programs that outlive a process."""
