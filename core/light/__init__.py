"""How much of the sky's and of the sun's light each surface receives: the ray tracer and what it finds out."""
