"""Pictures of a run's results, and the report that shows them. The pictures need matplotlib, which nothing else does.

In: the files of a result folder. Out: report.html, one page that opens offline. Read first: write_report.py.
"""
