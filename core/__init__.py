"""The science of CityPV: geometry, sun, weather, light, energy, results. Never imports bpy."""
