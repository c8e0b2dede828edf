"""The science of CityPV, in the order of its flow: geometry, sun, weather, light, energy, results. Never imports bpy."""
