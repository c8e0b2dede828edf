"""Light on the surfaces of a city by either of two estimators: gather asks what rays of patches
meet, and solves the radiosity equation with it; photons go forward (Bredemeier et al., Eq. 1 to 4),
also in the specular pass beside gather.

In: scene, suns, plan of effects. Out: the Transfer, free of weather. Read first: trace_run.py,
which takes one of them; then trace_gather.py, trace_forward.py, specular_light.py.
"""

DOORS = (
    "bare_light.trace_bare",
    "change_light.trace_change",
    "editable_city.trace_editable",
    "errors_of_change.errors_of_difference",
    "match_light.match_light",
    "measure_cover.measure_cover",
    "merge_transfers.MATRICES",
    "prepare_scene.PreparedScene",
    "prepare_scene.prepare_scene",
    "rays_file.read_rays",
    "rays_file.write_rays",
    "shadow_points.count_elements",
    "solve_suns.COUNTING",
    "specular_light.trace_hybrid",
    "string_shade.LOSS_STEP",
    "sun_matrix.keep_matrix",
    "sun_matrix.row_blocks",
    "sun_sampling_error.trace_sun_samples",
    "trace_gather.SUNS",
    "trace_gather.trace_gather",
    "trace_run.choose_year",
    "trace_run.trace_run",
    "trace_run.weigh_kept_suns",
    "traced.SKY_DOME",
    "transfer.ErrorParts",
    "transfer.SourceLight",
    "transfer.TraceRecord",
    "transfer.Transfer",
    "transfer.variance_of_mean",
)
