"""AgOpenGPS: the folder of one field."""
