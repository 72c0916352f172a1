"""Files written whole, text in JSON, and the versions that results depend on."""
