"""Show: the colours of a result, its legend, views and pictures, the timeline, tables, what single
faces yield, and the comparison of two cities.

In: face attributes of a city, a Session with Energy. Out: materials, colour attributes, 3D views,
city.blend and preview.png, tables of the panel. Read first: `show_result`.
"""
