"""The command line: commands, each of which imports what it needs when it runs."""
