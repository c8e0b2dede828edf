"""From irradiance to capacity factors and full load hours."""
