"""Weather of one or more years: readers for all formats, checks, and the built-in climate.

In: a file, or a place for the climate and the clear sky. Out: a Weather in UTC. Read first:
read_weather.py.
"""
