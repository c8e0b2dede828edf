"""From files of buildings to a triangulated scene whose surfaces have a kind."""
