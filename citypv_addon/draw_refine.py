"""Target and time of further rounds, in step Trace."""


def draw_refine(column, context):
    """Show target and time of further rounds, in step Trace."""
    seeing = context.scene.citypv_seeing
    column.prop(seeing, "refine")
    if seeing.refine:
        column.prop(seeing, "target_error")
        column.prop(seeing, "time_budget")
