"""The command line, its commands, and the self-check.

In: command line arguments. Out: files, text and an exit status. Read first: command_line.py, then
run/simulate.py.
"""

DOORS = ("command_line.main",)
