"""The city: polygons with one LoD per building, clean rings, outward normals, in metres; its trees
and racks.

In: the FileContent of each file. Out: a City, Crowns that attenuate rays, racks on a Scene. Read
first: city.py.
"""
