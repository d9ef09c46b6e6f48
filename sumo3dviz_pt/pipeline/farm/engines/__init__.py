"""What starts workers on machines: this one, a Dask cluster, Slurm."""
