"""Where the jobs of an experiment run: processes of this machine, a Dask cluster, or MPI."""
