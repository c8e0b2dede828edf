"""Show: the colours of a result, its legend, views and pictures, the timeline, the report, and what
single faces and buildings yield.

In: face attributes of a city, a Session with Energy. Out: materials, colour attributes, 3D views,
city.blend and preview.png, tables of the panel. Read first: `show_result`.
"""

DOORS = (
    "colour_faces.read_scale",
    "colour_user_meshes.colour_user_meshes",
    "colour_user_meshes.draw_as_before",
    "colour_user_meshes.uncolour_user_meshes",
    "draw_results.draw_results",
    "draw_view.DRAWN",
    "keep_report.draw_rows",
    "keep_report.keep_report",
    "select_faces.read_selection",
    "show_city.match_view",
    "show_city.show_city",
    "show_modules.find_modules",
    "show_modules.follow_modules",
    "show_modules.show_modules",
    "show_result.BEFORE",
    "show_result.find_before",
    "show_result.follow_choice",
    "show_result.follow_side_by_side",
    "show_result.follow_switch",
    "show_result.has_result",
    "show_result.show_before",
    "show_result.show_result",
    "timeline.TIMED",
    "timeline.follow_frame",
    "timeline.follow_timeline_show",
)
