"""What is written: tables, time series, the Transfer, CityJSON, glTF, the summary.

In: Transfer and Energy. Out: files in a folder that is whole or not there. Read first: write_faces.py.
"""
