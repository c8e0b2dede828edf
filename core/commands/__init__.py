"""The command line and what its commands do.

In: the words a user types. Out: files, text and an exit status. Read first: command_line.py, then simulate.py.
"""
