"""How the vehicles of `assets/` are modelled: from recipes to packed bodies; never at run time."""
