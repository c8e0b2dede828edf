"""The command line and its commands.

In: command line arguments. Out: files, text and an exit status. Read first: command_line.py, then simulate.py.
"""
