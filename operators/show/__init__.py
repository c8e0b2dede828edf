"""Show: the colours of a result, its legend, views and pictures, the timeline, the report, and what
single faces and buildings yield.

In: face attributes of a city, a Session with Energy. Out: materials, colour attributes, 3D views,
city.blend and preview.png, tables of the panel. Read first: `show_result`.
"""

DOORS = (
    "colour_user_meshes.colour_user_meshes",
    "colour_user_meshes.draw_as_before",
    "colour_user_meshes.own_modifiers",
    "colour_user_meshes.uncolour_user_meshes",
    "draw_results.draw_results",
    "draw_view.DRAWN",
    "keep_report.draw_rows",
    "keep_report.keep_report",
    "show_city.match_view",
    "show_city.show_city",
    "show_modules.show_modules",
    "show_result.find_before",
    "show_result.show_result",
    "timeline.follow_frame",
    "view_settings.TimelineSettings",
    "view_settings.ViewSettings",
)
