"""The walk on many machines: workers of a Dask cluster execute its tasks and keep the results in files."""
