"""What every process of flexarm does around its work: start, reserve, title, end."""
