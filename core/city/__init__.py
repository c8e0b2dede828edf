"""City polygons between file and scene: one LoD per building, clean rings, outward normals, metres.

In: the FileContent of each file. Out: a City. Read first: city.py, then assemble_city.py.
"""
