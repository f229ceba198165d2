"""The hospital's formats: a measurement as DICOM image and report, and what sends both to the hospital's archive.

Modules in reading order: `codes`, `subject`, `shared_modules`, `wording`, `image`, `content_items`, `report`,
`rejection`, `objects`, `outgoing`, `exam_files`, `association`, `storing`, `confirmation`, `delivery`, `sender`,
`worklist`, `hospital`.

It reads records and knows neither instrument nor web. pydicom and pynetdicom are imported when something is written
or sent, so only modules that were asked for by then import them.
"""
