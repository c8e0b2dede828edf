"""Light: what a trace will do and cost, the trace itself, and its light kept beside the .blend.

In: a Session with a Scene, a Request.
Out: a Session with a Transfer, results on the faces.
Read first: `trace_city`.
"""
