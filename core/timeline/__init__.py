"""The sun of every hour of the twelve months, and the light and yield that a traced city has of it.

In: Transfer, Weather, Energy. Out: Timeline. Read first: timeline.py.
"""
