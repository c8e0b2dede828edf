"""Irradiance, air temperature and wind of a year, from files or from a clear-sky model."""
