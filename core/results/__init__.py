"""What is written: tables, the Transfer, city models, the summary; and the report with its
pictures.

In: Transfer and Energy, or the files of a run. Out: files in a folder that is whole or not there.
Read first: write_tables.py.
"""
