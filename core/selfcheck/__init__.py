"""Closed forms and hard cases that any machine can check in seconds, and the plain scenes they are made of.

In: nothing. Out: expected and found values. Read first: selfcheck.py, then closed_form_checks.py.
"""
