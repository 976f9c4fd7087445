"""Files and tables: reading what comes from outside, writing what stays."""
