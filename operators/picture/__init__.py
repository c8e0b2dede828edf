"""Pictures: the colours of a result, its legend, cameras and views, rendered pictures, the
timeline.

In: face attributes of a city.
Out: materials, colour attributes, 3D views, city.blend and preview.png.
Read first: `show_result`.
"""
