"""General laws, one for each family: weights over given shapes."""
