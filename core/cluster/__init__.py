"""The same walk on many machines: a Dask cluster works on the stretches, one process joins them."""
