"""Workers of a sweep: processes of this machine or of a cluster, and the data they receive."""
