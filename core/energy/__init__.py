"""From relative irradiance and weather to capacity factors and full load hours, of the year and of
each hour.

In: a Transfer, a Weather, a module. Out: an Energy, a Timeline. Read first: compute_energy.py.
"""

DOORS = (
    "building_power.compute_building_hours",
    "building_power.compute_building_power",
    "check_inputs.check_string_settings",
    "compute_energy.compute_energy",
    "counted_area.CHOSEN",
    "counted_area.LEFT_OUT",
    "counted_area.MOST_COVERED",
    "counted_area.OF_ROWS",
    "counted_area.REASONS",
    "counted_area.classify_again",
    "counted_area.name_group",
    "counted_area.note_other_settings",
    "counted_area.rank_group",
    "energy.exceeded_energy",
    "grouped_surfaces.group_surfaces",
    "left_out.check_left_out",
    "left_out.describe_gone",
    "paying.choose_modules",
    "power.conditions_of_modules",
    "power.tabulate_power",
    "pv_system.ELECTRIC",
    "pv_system.KINDS",
    "pv_system.MOUNTINGS",
    "pv_system.build_system",
    "pv_system.pick_module",
    "pv_system.suggest_modules",
    "standard_errors.errors_of_energy",
    "standard_errors.join_own",
    "sum_block.Block",
    "time_axis.read_zone",
    "timeline.Timeline",
)
