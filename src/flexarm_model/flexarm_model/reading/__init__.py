"""From the files of an arm to what it is: YAML, imported bodies, where files are found."""
