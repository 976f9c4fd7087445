"""Snow that edges cut: templates that ``compiled`` joins with the laws."""
