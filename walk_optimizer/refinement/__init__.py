"""The accurate solution: gaits of the report's grid refined, and speeds straight from refined neighbours."""
