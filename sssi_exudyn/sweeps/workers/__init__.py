"""Who does the runs of a sweep: processes of this machine or of a cluster, and what is handed to them."""
