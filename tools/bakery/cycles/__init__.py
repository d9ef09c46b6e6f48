"""E-scooters, mopeds, motorcycles, rickshaws and wheelchairs with their riders."""
