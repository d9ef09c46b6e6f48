"""Static objects of the scenario: trees, fences, buildings."""
