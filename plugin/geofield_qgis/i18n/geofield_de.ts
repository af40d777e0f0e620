<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
  <context>
    <name>geofield</name>
    <message>
      <location filename="algorithm.py" />
      <source>What this form shows holds, whatever a plan was made with.</source>
      <translation>Es gilt, was dieses Formular zeigt, womit ein Plan auch gemacht wurde.</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Show the layers in the map</source>
      <translation>Die Layer in der Karte zeigen</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Picture</source>
      <translation>Bild</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Another picture: a file, a folder, a tile address or a source's name</source>
      <translation>Ein anderes Bild: Datei, Ordner, Kacheladresse oder Name einer Quelle</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Own parcels: the one with the point is the field</source>
      <translation>Eigene Schläge: der mit dem Punkt ist das Feld</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Obstacles to avoid: polygons, points with radius_m, lines</source>
      <translation>Zu meidende Hindernisse: Flächen, Punkte mit radius_m, Linien</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Plan: a layer of its GeoPackage</source>
      <translation>Plan: ein Layer seines GeoPackage</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Choose a picture.</source>
      <translation>Wählen Sie ein Bild.</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Choose a layer of a plan.</source>
      <translation>Wählen Sie einen Layer eines Plans.</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>The layer {0} is being edited: end that first, its file is replaced.</source>
      <translation>Der Layer {0} wird bearbeitet: beenden Sie das zuerst, seine Datei wird ersetzt.</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Plan</source>
      <translation>Plan</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>Plan (GeoPackage)</source>
      <translation>Plan (GeoPackage)</translation>
    </message>
    <message>
      <location filename="algorithm.py" />
      <source>{0} does not count here unless it is named as settings file.</source>
      <translation>{0} zählt hier nicht, außer als Einstellungsdatei genannt.</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Plan a field</source>
      <translation>Ein Feld planen</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Stage by stage</source>
      <translation>Schritt für Schritt</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Plan many fields</source>
      <translation>Viele Felder planen</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Find the outline</source>
      <translation>Feldgrenze finden</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Find the obstacles</source>
      <translation>Hindernisse finden</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Plan the tracks</source>
      <translation>Fahrspuren planen</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Plan tracks and route</source>
      <translation>Fahrspuren und Fahrweg planen</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Get imagery</source>
      <translation>Luftbild holen</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>A point in the field</source>
      <translation>Ein Punkt im Feld</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Centre</source>
      <translation>Mitte</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Folder for the products</source>
      <translation>Ordner für die Ergebnisse</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Points in the fields, or parcels</source>
      <translation>Punkte in den Feldern, oder Schläge</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Folder of the farm</source>
      <translation>Ordner des Betriebs</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Fields planned</source>
      <translation>Geplante Felder</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Fields</source>
      <translation>Felder</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Folder for the plans</source>
      <translation>Ordner für die Pläne</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Length of all segments, metres</source>
      <translation>Länge aller Abschnitte, Meter</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Only some fields of {0} are taken: the obstacles in it do not count.</source>
      <translation>Nur ein Teil der Felder von {0} wird genommen: die Hindernisse darin zählen nicht.</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Or an extent</source>
      <translation>Oder ein Ausschnitt</translation>
    </message>
    <message>
      <location filename="algorithms.py" />
      <source>Give a centre or an extent.</source>
      <translation>Geben Sie eine Mitte oder einen Ausschnitt an.</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Review of a field</source>
      <translation>Durchsicht eines Feldes</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>There is no plan in this project: plan a field first.</source>
      <translation>In diesem Projekt ist kein Plan: planen Sie zuerst ein Feld.</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>The route is planned anew when the edits are saved.</source>
      <translation>Der Fahrweg wird beim Speichern neu geplant.</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Review the plan of the active layer</source>
      <translation>Plan des aktiven Layers durchsehen</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Previous</source>
      <translation>Voriges</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Next</source>
      <translation>Nächstes</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Confirm</source>
      <translation>Bestätigen</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Reject</source>
      <translation>Verwerfen</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Smaller</source>
      <translation>Kleiner</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Larger</source>
      <translation>Größer</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Move: click its middle</source>
      <translation>Verschieben: Mitte anklicken</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Draw: drag a circle</source>
      <translation>Zeichnen: Kreis aufziehen</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Undo</source>
      <translation>Rückgängig</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Redo</source>
      <translation>Wiederholen</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>Save and plan again</source>
      <translation>Speichern, neu planen</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>{0} is not there: put it back, or choose a layer of another plan.</source>
      <translation>{0} ist nicht da: Legen Sie die Datei zurück, oder wählen Sie einen Layer eines anderen Plans.</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>The obstacles are read-only here: nothing can be decided.</source>
      <translation>Die Hindernisse sind hier schreibgeschützt: nichts lässt sich entscheiden.</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>The plan was changed outside of this panel: look again.</source>
      <translation>Der Plan wurde außerhalb dieses Bedienfelds geändert: Sehen Sie noch einmal hin.</translation>
    </message>
    <message>
      <location filename="dock.py" />
      <source>This obstacle is not round: use QGIS's vertex tool.</source>
      <translation>Dieses Hindernis ist nicht rund: nehmen Sie das Stützpunktwerkzeug von QGIS.</translation>
    </message>
    <message>
      <location filename="engine.py" />
      <source>geofield's engine is not there: install it or name it under Plugins &gt; geofield &gt; Engine...</source>
      <translation>Das Rechenprogramm von geofield fehlt: installieren oder benennen Sie es unter Erweiterungen &gt; geofield &gt; Rechenprogramm...</translation>
    </message>
    <message>
      <location filename="engine.py" />
      <source>Stopped; nothing half-written is left.</source>
      <translation>Abgebrochen; nichts halb Geschriebenes bleibt zurück.</translation>
    </message>
    <message>
      <location filename="engine.py" />
      <source>The engine {command} is version {found}, but this plugin belongs to {wanted}: update it under Plugins &gt; geofield &gt; Engine...</source>
      <translation>Das Rechenprogramm {command} hat Version {found}, die Erweiterung gehört zu {wanted}: aktualisieren Sie es unter Erweiterungen &gt; geofield &gt; Rechenprogramm...</translation>
    </message>
    <message>
      <location filename="engine.py" />
      <source>The engine does not start: {0}</source>
      <translation>Das Rechenprogramm startet nicht: {0}</translation>
    </message>
    <message>
      <location filename="engine.py" />
      <source>The engine ended unexpectedly (code {0}).</source>
      <translation>Das Rechenprogramm endete unerwartet (Code {0}).</translation>
    </message>
    <message>
      <location filename="engine.py" />
      <source>The engine {command} does not start: repair it under Plugins &gt; geofield &gt; Engine...</source>
      <translation>Das Rechenprogramm {command} startet nicht: reparieren Sie es unter Erweiterungen &gt; geofield &gt; Rechenprogramm...</translation>
    </message>
    <message>
      <location filename="engine_dialog.py" />
      <source>geofield's engine</source>
      <translation>Rechenprogramm von geofield</translation>
    </message>
    <message>
      <location filename="engine_dialog.py" />
      <source>Engine</source>
      <translation>Rechenprogramm</translation>
    </message>
    <message>
      <location filename="engine_dialog.py" />
      <source>The geofield command</source>
      <translation>Der Befehl geofield</translation>
    </message>
    <message>
      <location filename="engine_dialog.py" />
      <source>Install or update</source>
      <translation>Installieren oder aktualisieren</translation>
    </message>
    <message>
      <location filename="engine_dialog.py" />
      <source>Install from a file...</source>
      <translation>Aus einer Datei installieren...</translation>
    </message>
    <message>
      <location filename="engine_dialog.py" />
      <source>Use another command...</source>
      <translation>Anderen Befehl benutzen...</translation>
    </message>
    <message>
      <location filename="engine_dialog.py" />
      <source>Find it by itself</source>
      <translation>Selbst suchen</translation>
    </message>
    <message>
      <location filename="engine_dialog.py" />
      <source>Ready: {0}, version {1}</source>
      <translation>Bereit: {0}, Version {1}</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Files and checks</source>
      <translation>Dateien und Prüfungen</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Export for terminals</source>
      <translation>Export für Terminals</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Import boundaries</source>
      <translation>Feldgrenzen einlesen</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Check products</source>
      <translation>Ergebnisse prüfen</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Compare with a truth</source>
      <translation>Mit einer Referenz vergleichen</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Files</source>
      <translation>Dateien</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Errors</source>
      <translation>Fehler</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Warnings</source>
      <translation>Warnungen</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Findings</source>
      <translation>Befunde</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>No fault found.</source>
      <translation>Kein Fehler gefunden.</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Detected obstacles</source>
      <translation>Gefundene Hindernisse</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Truth</source>
      <translation>Referenz</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Picture to draw on</source>
      <translation>Bild als Untergrund</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>Drawing of hits and misses</source>
      <translation>Zeichnung der Treffer und Fehler</translation>
    </message>
    <message>
      <location filename="file_algorithms.py" />
      <source>The engine gave no answer.</source>
      <translation>Das Rechenprogramm gab keine Antwort.</translation>
    </message>
    <message>
      <location filename="install.py" />
      <source>The engine will be fetched from the Python package index (about {0} MB) and put into {2} ({1} MB there). The Python of QGIS is not touched, and removing that folder removes everything.</source>
      <translation>Das Rechenprogramm wird vom Python-Paketverzeichnis geholt (etwa {0} MB) und in {2} abgelegt (dort {1} MB). Das Python von QGIS bleibt unberührt; wer den Ordner löscht, hat alles entfernt.</translation>
    </message>
    <message>
      <location filename="install.py" />
      <source>This copy of the plugin carries no list of requirements.</source>
      <translation>Diese Kopie der Erweiterung enthält keine Paketliste.</translation>
    </message>
    <message>
      <location filename="install.py" />
      <source>No Python of version 3.11 or newer was found: install one from python.org.</source>
      <translation>Es wurde kein Python ab Version 3.11 gefunden: installieren Sie eines von python.org.</translation>
    </message>
    <message>
      <location filename="install.py" />
      <source>The engine there is in use: close geofield's panel in QGIS, then repeat.</source>
      <translation>Das Rechenprogramm dort ist in Gebrauch: schließen Sie das Bedienfeld von geofield in QGIS und wiederholen Sie.</translation>
    </message>
    <message>
      <location filename="install.py" />
      <source>It ended unexpectedly.</source>
      <translation>Es endete unerwartet.</translation>
    </message>
    <message>
      <location filename="jobs.py" />
      <source>The engine ended unexpectedly; the next edit starts it again.</source>
      <translation>Das Rechenprogramm endete unerwartet; die nächste Änderung startet es wieder.</translation>
    </message>
    <message>
      <location filename="parameters.py" />
      <source>TOML file with a table per stage, for what this form leaves at its default.</source>
      <translation>TOML-Datei mit einer Tabelle je Schritt, für alles, was hier auf der Vorgabe steht.</translation>
    </message>
    <message>
      <location filename="planner.py" />
      <source>Finding the outline...</source>
      <translation>Die Feldgrenze wird gesucht...</translation>
    </message>
    <message>
      <location filename="planner.py" />
      <source>Finding the obstacles...</source>
      <translation>Hindernisse werden gesucht...</translation>
    </message>
    <message>
      <location filename="planner.py" />
      <source>Planning the tracks...</source>
      <translation>Fahrspuren werden geplant...</translation>
    </message>
    <message>
      <location filename="planner.py" />
      <source>Stop</source>
      <translation>Abbrechen</translation>
    </message>
    <message>
      <location filename="planner.py" />
      <source>There is no picture here: add a raster layer of the place first.</source>
      <translation>Hier ist kein Bild: laden Sie zuerst einen Rasterlayer der Gegend.</translation>
    </message>
    <message>
      <location filename="planner.py" />
      <source>Whether the terms of {0} allow this is for you to say: use Plan a field in the toolbox, or a picture of your own.</source>
      <translation>Ob die Bedingungen von {0} das erlauben, müssen Sie sagen: nehmen Sie Ein Feld planen aus den Verarbeitungswerkzeugen oder ein eigenes Bild.</translation>
    </message>
    <message>
      <location filename="planner.py" />
      <source>Tracks: {0}, {1} km. Shift+click adds ground, Alt+click takes it away.</source>
      <translation>Spuren: {0}, {1} km. Umschalt+Klick nimmt Boden dazu, Alt+Klick weg.</translation>
    </message>
    <message>
      <location filename="review.py" />
      <source>Move obstacle</source>
      <translation>Hindernis verschieben</translation>
    </message>
    <message>
      <location filename="review.py" />
      <source>Radius of obstacle</source>
      <translation>Radius des Hindernisses</translation>
    </message>
    <message>
      <location filename="review.py" />
      <source>Draw obstacle</source>
      <translation>Hindernis zeichnen</translation>
    </message>
    <message>
      <location filename="review.py" />
      <source>Status {0}</source>
      <translation>Status {0}</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>detected</source>
      <translation>gefunden</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>possible: not driven around</source>
      <translation>möglich: wird nicht umfahren</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>confirmed</source>
      <translation>bestätigt</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>rejected</source>
      <translation>verworfen</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>added by hand</source>
      <translation>von Hand ergänzt</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>{0} confirmed</source>
      <translation>{0} bestätigt</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>{0} rejected</source>
      <translation>{0} verworfen</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>{0} added</source>
      <translation>{0} ergänzt</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>Choose a layer of a plan, then press the button.</source>
      <translation>Wählen Sie einen Layer eines Plans und klicken Sie auf die Schaltfläche.</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>Tracks: {0}, segments: {1}, {2} km</source>
      <translation>Spuren: {0}, Abschnitte: {1}, {2} km</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>{0} left to look at</source>
      <translation>{0} noch zu prüfen</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>Obstacle {0}</source>
      <translation>Hindernis {0}</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>new</source>
      <translation>neu</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>, outline {0:.0%} certain</source>
      <translation>, Feldgrenze zu {0:.0%} sicher</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>radius {0} m</source>
      <translation>Radius {0} m</translation>
    </message>
    <message>
      <location filename="review_labels.py" />
      <source>confidence {0:.0%}</source>
      <translation>Sicherheit {0:.0%}</translation>
    </message>
    <message>
      <location filename="sources.py" />
      <source>The layer {0} has edits that are not saved: save them first.</source>
      <translation>Der Layer {0} hat Änderungen, die nicht gespeichert sind: speichern Sie zuerst.</translation>
    </message>
    <message>
      <location filename="sources.py" />
      <source>{0} has no features to work on.</source>
      <translation>{0} hat keine Objekte.</translation>
    </message>
    <message>
      <location filename="window.py" />
      <source>Plan the field here</source>
      <translation>Das Feld hier planen</translation>
    </message>
    <message>
      <location filename="window.py" />
      <source>Click in a field. Shift+click adds ground, Alt+click takes it away.</source>
      <translation>Klicken Sie in ein Feld. Umschalt+Klick nimmt Boden dazu, Alt+Klick nimmt ihn weg.</translation>
    </message>
    <message>
      <location filename="window.py" />
      <source>Review obstacles</source>
      <translation>Hindernisse durchsehen</translation>
    </message>
    <message>
      <location filename="window.py" />
      <source>Engine...</source>
      <translation>Rechenprogramm...</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>From a picture and a point in a field, or its boundary, to outline, obstacles and tracks.</source>
      <translation>Vom Bild und einem Punkt im Feld, oder seiner Grenze, zu Feldgrenze, Hindernissen und Fahrspuren.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>IMAGERY is a GeoTIFF, a folder of them, or any other source that `geofield tiles` takes. Written are the picture used (scene.tif), field.gpkg with a QGIS project, GeoJSON, Shapefiles, RDF, a map picture and report.json.</source>
      <translation>Das Bild ist ein GeoTIFF, ein Ordner davon oder eine andere Quelle, die auch „Luftbild holen“ nimmt. Geschrieben werden das verwendete Bild (scene.tif), field.gpkg mit einem QGIS-Projekt, GeoJSON, Shapefiles, RDF, ein Kartenbild und report.json.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Find the outline of the field around a point.</source>
      <translation>Die Grenze des Feldes um einen Punkt finden.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>IMAGERY is a picture or any other source that `geofield tiles` takes. Where the outline touches the window's edge, the window grows as far as the picture reaches.</source>
      <translation>Das Bild ist eine Datei oder eine andere Quelle, die auch „Luftbild holen“ nimmt. Wo die Feldgrenze den Rand des Ausschnitts berührt, wächst der Ausschnitt, so weit das Bild reicht.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Find the obstacles in a field.</source>
      <translation>Die Hindernisse in einem Feld finden.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>IMAGERY is the picture that the field was found in. Rows that a person confirmed, rejected or drew in FIELD.gpkg stay as they are; the settings that it was made with hold where you say nothing else. The tracks are removed, for they no longer fit: run `geofield tracks` next.</source>
      <translation>Das Bild ist das, in dem das Feld gefunden wurde. Was im Plan von Hand bestätigt, verworfen oder gezeichnet wurde, bleibt, wie es ist. Die Fahrspuren werden entfernt, denn sie passen nicht mehr: als Nächstes „Fahrspuren planen“ ausführen.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Plan the tracks of one or many fields.</source>
      <translation>Die Fahrspuren eines oder vieler Felder planen.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>FILE is a GeoPackage of geofield, whose field and obstacles count as they are now, with all that a person changed, and whose settings hold where you say nothing else (one of several fields keeps none); or any file of polygons (Shapefile, GeoJSON, GeoPackage, ...), each of which is a field. Their columns come along, and those named like settings (spacing_m, heading_deg, ...) hold for their field.</source>
      <translation>Die Felder sind der Layer eines Plans von geofield, dessen Feld und Hindernisse so zählen, wie sie jetzt sind, mit allem, was von Hand geändert wurde; oder beliebige Polygone (Shapefile, GeoJSON, GeoPackage, ...), von denen jedes ein Feld ist. Ihre Spalten kommen mit, und solche, die wie Einstellungen heißen (spacing_m, heading_deg, ...), gelten für ihr Feld.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Get the picture of a place as a georeferenced GeoTIFF, from any source.</source>
      <translation>Das Bild eines Ortes als georeferenziertes GeoTIFF holen, aus einer beliebigen Quelle.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>SOURCE is the name of a source (see `geofield sources`), a tile address with {z}/{x}/{y}, the address of a WMS, WMTS or GeoTIFF, a picture, a folder of pictures, an MBTiles or a STAC file. Keys are read from the environment (GEOFIELD_KEY_NAME) or the settings file.</source>
      <translation>Die Quelle ist der Name einer Quelle (siehe `geofield sources`), eine Kacheladresse mit {z}/{x}/{y}, die Adresse eines WMS, WMTS oder GeoTIFF, ein Bild, ein Ordner mit Bildern, eine MBTiles- oder eine STAC-Datei. Schlüssel kommen aus der Umgebung (GEOFIELD_KEY_NAME) oder der Einstellungsdatei.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>The picture is cut on the source's own pixels, so nothing is resampled and the georeference is exact. Tiles are kept in a cache where the source's terms allow it: an interrupted download goes on where it stopped.</source>
      <translation>Das Bild wird an den Pixeln der Quelle geschnitten: nichts wird umgerechnet, und die Georeferenz ist genau. Kacheln werden zwischengespeichert, wo die Bedingungen der Quelle es erlauben: ein unterbrochener Abruf geht dort weiter, wo er aufhörte.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Write other formats from one or more plans.</source>
      <translation>Einen Plan in anderen Formaten schreiben.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>PLAN is a GeoPackage of geofield, the folder of a farm, or any file it can import. Of several plans, formats that can hold several fields get them in one file (one ISOXML task file, one set of Shapefiles, one KML with folders, one linked dataset); the others have a file or folder per field. Columns "customer" and "farm" of the field say whose it is. All products come into place together or not at all; what a format cannot carry is said once.</source>
      <translation>Der Plan ist ein GeoPackage von geofield oder das eines Betriebs. Von mehreren Feldern kommen Formate, die mehrere fassen, in eine Datei (eine ISOXML-Auftragsdatei, ein Satz Shapefiles, eine KML mit Ordnern, ein Linked-Data-Datensatz); die anderen haben eine Datei oder einen Ordner je Feld. Die Spalten „customer“ und „farm“ des Feldes sagen, wem es gehört. Alle Dateien erscheinen zusammen oder gar nicht; was ein Format nicht aufnehmen kann, wird einmal gesagt.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Read boundaries, obstacles and guidance lines from other programs' files.</source>
      <translation>Grenzen, Hindernisse und Leitlinien aus Dateien anderer Programme lesen.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>FILE is a Shapefile, GeoPackage, GeoJSON, KML, GPX, GeoParquet, FlatGeobuf, DXF, ISOXML TASKDATA, AgOpenGPS field, a CSV table with lat and lon (or WKT), or what else GDAL finds shapes in (GML, MapInfo, a file geodatabase), in any CRS. Several files make one field: the boundary from one, the obstacles from another. A lone polygon, or line of GPX or DXF that ends where it began, is the field; of several, whole words of the layers' names (boundary, trees), their columns, and what lies in what decide. What was taken as what is said on stderr.</source>
      <translation>Eine Datei ist ein Shapefile, GeoPackage, GeoJSON, KML, GPX, GeoParquet, FlatGeobuf, DXF, ISOXML TASKDATA, ein Feld von AgOpenGPS, eine CSV-Tabelle mit lat und lon (oder WKT) oder was GDAL sonst an Dateien mit Formen liest (GML, MapInfo, eine File-Geodatabase), in einem beliebigen KBS. Mehrere Dateien ergeben ein Feld: die Grenze aus der einen, die Hindernisse aus der anderen. Ein einzelnes Polygon, oder eine Linie von GPX oder DXF, die endet, wo sie begann, ist das Feld; bei mehreren entscheiden ganze Wörter in den Namen der Layer (boundary, trees), ihre Spalten und was worin liegt. Was wofür genommen wurde, steht im Protokoll.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Check each FILE, of any format: the format's rules, and whether the plan fits together.</source>
      <translation>Dateien jedes Formats prüfen: die Regeln des Formats, und ob der Plan in sich stimmt.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Exit code 1 when there is an error; warnings alone leave it at 0.</source>
      <translation>Die Zahl der Fehler und der Warnungen steht in den Ergebnissen.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Compare DETECTED obstacles with a TRUTH of points, boxes or polygons, which may be a CSV.</source>
      <translation>Erkannte Hindernisse mit einer Referenz aus Punkten, Rechtecken oder Polygonen vergleichen, auch aus einer CSV-Datei.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>TRUTH may be a plan that a person reviewed: what they rejected is no true obstacle. Matching is one to one. Prints precision, recall, F1 and the error of the radii with 95 % intervals. With --driving also how many true obstacles the plan's tracks run through, within 2 m of their centres, what ground false ones cost, and how many the confidences say stand among those that are merely possible.</source>
      <translation>Die Referenz darf ein durchgesehener Plan sein: was darin verworfen wurde, ist kein wahres Hindernis. Zugeordnet wird eins zu eins. Das Ergebnis sind Precision, Recall, F1 und der Fehler der Radien mit Intervallen von 95 %. Auf Wunsch auch, durch wie viele wahre Hindernisse die Fahrspuren des Plans führen (höchstens 2 m neben ihrer Mitte), welchen Boden falsche kosten und wie viele wahre den Sicherheiten nach unter den nur möglichen sind.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Plan many fields into one farm.</source>
      <translation>Viele Felder zu einem Betrieb planen.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>PLACES is a file with a row per field: points (CSV or Parquet with columns lat and lon, or any vector file) or parcels (polygons), whose outlines are taken as they are. Columns named like settings (spacing_m, heading_deg, name, ...) hold for their field; all others come along. IMAGERY is whatever `geofield run` takes; parcels need none.</source>
      <translation>Die Orte haben eine Zeile je Feld: Punkte oder Schläge (Polygone), deren Grenzen so genommen werden, wie sie sind. Spalten, die wie Einstellungen heißen (spacing_m, heading_deg, name, ...), gelten für ihr Feld; alle anderen kommen mit. Das Bild ist, was auch „Ein Feld planen“ nimmt; Schläge brauchen keines.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>What a person edited in the farm's overview (farm.gpkg) is taken in first and kept. Ctrl+C lets the fields at work end; a second one stops at once. The same command goes on.</source>
      <translation>Was in der Übersicht des Betriebs (farm.gpkg) von Hand bearbeitet wurde, wird zuerst übernommen und bleibt. Wird abgebrochen, so geht derselbe Lauf dort weiter, wo er aufhörte.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Size (m)</source>
      <translation>Fenstergröße (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Side of the window read around the point, metres; all of a small picture without. It grows until it shows the field.</source>
      <translation>Seite des Ausschnitts um den Punkt, Meter; ohne sie kleine Bilder ganz. Er wächst, bis er den ganzen Schlag zeigt.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Bands</source>
      <translation>Kanäle</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>What the picture's bands show, in order: red, green, blue, nir, grey, other.</source>
      <translation>Was die Kanäle des Bildes zeigen, der Reihe nach: red, green, blue, nir, grey, other.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>CRS</source>
      <translation>KBS</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>CRS of a picture that does not say its own, e.g. EPSG:32633.</source>
      <translation>KBS eines Bildes, das seines nicht nennt, z. B. EPSG:32633.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Method</source>
      <translation>Verfahren</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>How the outline is found: auto (colour, near infrared, edges) or study (brightness threshold).</source>
      <translation>Wie die Feldgrenze gefunden wird: auto (Farbe, nahes Infrarot, Kanten) oder study (Helligkeitsschwelle).</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Holes</source>
      <translation>Löcher</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>What becomes of crowns, huts and ponds inside: fill (the way of auto) or keep as holes (the way of study).</source>
      <translation>Was aus Kronen, Hütten und Teichen im Feld wird: fill (füllen, wie bei auto) oder keep (Löcher bleiben, wie bei study).</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Min hole (m²)</source>
      <translation>Kleinstes Loch (m²)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Holes below this size are filled, square metres.</source>
      <translation>Löcher unter dieser Größe werden gefüllt, Quadratmeter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Tolerance (px)</source>
      <translation>Abweichung (px)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>How far the straightened outline may leave the pixels; 0 keeps them all.</source>
      <translation>Wie weit die begradigte Feldgrenze von den Pixeln abweichen darf; 0 behält alle.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Smooth</source>
      <translation>Glätten</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Smoothing of the picture first; diffusion is anisotropic.</source>
      <translation>Glättung des Bildes vorab; diffusion ist anisotrop.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Include</source>
      <translation>Gehört dazu</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Further ground that belongs to the field, LON,LAT; repeat for several.</source>
      <translation>Weiterer Boden, der zum Feld gehört, als LÄNGE,BREITE; mehrere durch Semikolon getrennt.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Exclude</source>
      <translation>Gehört nicht dazu</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Ground that does not belong to the field, LON,LAT; repeat for several.</source>
      <translation>Boden, der nicht zum Feld gehört, als LÄNGE,BREITE; mehrere durch Semikolon getrennt.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Strategy</source>
      <translation>Verfahren der Suche</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>How obstacles are found: auto, or a way of the study.</source>
      <translation>Wie Hindernisse gefunden werden: auto oder ein Verfahren der Studie.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Radius (m)</source>
      <translation>Radius (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Smallest and largest crown radius, metres; 1 to 15 with auto, 2 to 9 with the study's strategies by default.</source>
      <translation>Kleinster und größter Kronenradius, Meter; sonst 1 bis 15 mit auto, 2 bis 9 mit den Verfahren der Studie.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Buffer (m)</source>
      <translation>Sicherheitsabstand (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Safety margin around each obstacle, metres.</source>
      <translation>Sicherheitsabstand um jedes Hindernis, Meter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Cost missed</source>
      <translation>Gewicht von Übersehenem</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>auto: what driving into a thing costs, against a look at one place of the map; it decides what is detected, and what only possible.</source>
      <translation>auto: was es kostet, in etwas hineinzufahren, gemessen an einem Blick auf eine Stelle der Karte; danach gilt etwas als erkannt oder nur als möglich.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Careful</source>
      <translation>Vorsichtig</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>auto: drive around what is only possible, too.</source>
      <translation>auto: auch um das herumfahren, was nur möglich ist.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Min confidence</source>
      <translation>Mindestsicherheit</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>auto: confidence from which a thing is driven around, instead of the cost.</source>
      <translation>auto: Sicherheit, ab der um etwas herumgefahren wird, statt der Kosten.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Polarity</source>
      <translation>Dunkel oder hell</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>auto: crowns darker or brighter than what is around them.</source>
      <translation>auto: Kronen, die dunkler oder heller sind als ihre Umgebung.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Others</source>
      <translation>Auch anderes</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>auto: find what is not round, too: ponds, huts, clumps.</source>
      <translation>auto: auch finden, was nicht rund ist: Teiche, Hütten, Baumgruppen.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Edge method</source>
      <translation>Kantenverfahren</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>The study's strategies: edge method.</source>
      <translation>Verfahren der Studie: wie Kanten gefunden werden.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Threshold</source>
      <translation>Schwelle</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>single: edge threshold.</source>
      <translation>single: Schwelle der Kanten.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Circle method</source>
      <translation>Kreisverfahren</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>The study's strategies: circle transform.</source>
      <translation>Verfahren der Studie: Kreistransformation.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Sensitivity</source>
      <translation>Empfindlichkeit</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>The study's strategies: of the circle transform.</source>
      <translation>Verfahren der Studie: Empfindlichkeit der Kreistransformation.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Grey check</source>
      <translation>Grauprüfung</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Drop discs brighter than 127.37 (absolute) or than the field (relative).</source>
      <translation>Scheiben verwerfen, die heller sind als 127,37 (absolute) oder als das Feld (relative).</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Machine</source>
      <translation>Maschine</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Machine of the settings file, [machines.NAME]: its width, turning radius, overhang and offset.</source>
      <translation>Maschine aus der Einstellungsdatei, [machines.NAME]: ihre Breite, ihr Wenderadius, Überhang und Versatz.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Width (m)</source>
      <translation>Arbeitsbreite (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Working width, metres; without a spacing, that is this less the overlap.</source>
      <translation>Arbeitsbreite, Meter; ohne Abstand ist dieser sie weniger der Überlappung.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Overlap (m)</source>
      <translation>Überlappung (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>How far neighbouring passes overlap, metres; below 0 a gap between them.</source>
      <translation>Wie weit benachbarte Überfahrten einander überlappen, Meter; unter 0 eine Lücke dazwischen.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Spacing (m)</source>
      <translation>Spurabstand (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Distance between tracks, metres.</source>
      <translation>Abstand der Fahrspuren, Meter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Step (m)</source>
      <translation>Punktabstand (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Distance between track points, metres.</source>
      <translation>Abstand der Spurpunkte, Meter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Direction</source>
      <translation>Richtung</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Of the tracks: dominant (the way most of the border runs), longest_edge, hough, fewest, fewest_turns, or a heading in degrees clockwise from true north.</source>
      <translation>Der Fahrspuren: dominant (wie der Rand meist verläuft), longest_edge, hough, fewest, fewest_turns oder ein Kurs in Grad von geografisch Nord im Uhrzeigersinn.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>A-B line</source>
      <translation>A-B-Linie</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>A-B line to follow: longitude and latitude of A, then of B.</source>
      <translation>A-B-Linie: Länge und Breite von A, dann von B.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Through</source>
      <translation>Durch diesen Ort</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Longitude and latitude of a place that a track passes through.</source>
      <translation>Ein Ort, durch den eine Spur geht.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Offset (m)</source>
      <translation>Versatz (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Of the first track from its edge, metres; half the working width, or half the spacing, by default.</source>
      <translation>Abstand der ersten Spur vom Rand, Meter; sonst die halbe Arbeitsbreite oder der halbe Spurabstand.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Last strip</source>
      <translation>Letzter Streifen</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>The rest at the far side: overrun the border, leave it, shift the last track back, or spread all tracks evenly.</source>
      <translation>Der Rest am anderen Rand: überfahren, lassen, letzte Spur zurücksetzen oder alle gleich verteilen.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Headland (m)</source>
      <translation>Vorgewende (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Width of the headland along the border, metres.</source>
      <translation>Breite des Vorgewendes, Meter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Headland passes</source>
      <translation>Überfahrten im Vorgewende</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Width of the headland in passes of one spacing, instead of metres.</source>
      <translation>Breite des Vorgewendes in Überfahrten von einem Spurabstand, statt in Metern.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Headland holes</source>
      <translation>Vorgewende um Löcher</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>A headland around the field's holes too.</source>
      <translation>Vorgewende auch um Löcher im Feld.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Min segment (m)</source>
      <translation>Kürzester Abschnitt (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Shorter segments are not driven, metres.</source>
      <translation>Kürzere Abschnitte werden nicht gefahren, Meter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Clearance (m)</source>
      <translation>Zusätzlicher Abstand (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Distance to keep from obstacles, on top of their margin, metres.</source>
      <translation>Abstand zu Hindernissen über deren Rand hinaus, Meter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Straight tolerance (m)</source>
      <translation>Geradheit (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>How far the vertices of a straight edge may stray, metres.</source>
      <translation>Wie weit die Stützpunkte einer geraden Kante abweichen dürfen, Meter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Route</source>
      <translation>Fahrweg</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Order of work, with the ways between segments.</source>
      <translation>Reihenfolge der Arbeit mit den Wegen dazwischen.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Skip</source>
      <translation>Ausgelassene Spuren</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Tracks left out at each turn of the route skip.</source>
      <translation>Fahrspuren, die beim Fahrweg skip an jeder Wende ausgelassen werden.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Turning radius (m)</source>
      <translation>Wenderadius (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Of the machine, metres: turns become curves.</source>
      <translation>Wenderadius der Maschine, Meter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Curve</source>
      <translation>Kurve</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Turns forwards only, or with reversing.</source>
      <translation>Wenden nur vorwärts oder mit Zurücksetzen.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Margin (m)</source>
      <translation>Rand für Wenden (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>How far turns may reach beyond the border, metres.</source>
      <translation>Wie weit Wenden über den Rand reichen dürfen, Meter.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Start</source>
      <translation>Beginn</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Longitude and latitude of the place where the route begins.</source>
      <translation>Ort, an dem der Fahrweg beginnt.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Formats</source>
      <translation>Formate</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Formats of the products.</source>
      <translation>Formate der Ergebnisse.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Points</source>
      <translation>Spurpunkte</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Track points in linked data, too: most of its bytes.</source>
      <translation>Spurpunkte auch in Linked Data: der größte Teil der Datei.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Threads</source>
      <translation>Gleichzeitige Abrufe</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Tiles fetched at once.</source>
      <translation>Kacheln, die gleichzeitig geholt werden.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Cache dir</source>
      <translation>Ordner des Speichers</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Folder of the tile caches; the user's cache folder by default.</source>
      <translation>Ordner für zwischengespeicherte Kacheln; sonst der Cache-Ordner des Benutzers.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Cache max (MB)</source>
      <translation>Größter Speicher (MB)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Tiles kept per source at most, megabytes.</source>
      <translation>Wie viele Kacheln je Quelle höchstens behalten werden, Megabyte.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Cache max (days)</source>
      <translation>Ältester Speicher (Tage)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Tiles are fetched anew after, days.</source>
      <translation>Nach wie vielen Tagen Kacheln neu geholt werden.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Allow</source>
      <translation>Erlaubt</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Folder or address that a VRT, tile index, STAC file, capabilities document or redirect may lead to; repeat for several.</source>
      <translation>Ordner oder Adresse, zu der eine VRT-Datei, ein Kachelindex, eine STAC-Datei, ein Capabilities-Dokument oder eine Weiterleitung führen darf; mehrere durch Semikolon getrennt.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Keys</source>
      <translation>Schlüssel</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Keys by source name; GEOFIELD_KEY_NAME in the environment wins.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Sources</source>
      <translation>Quellen</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Sources of your own, by name: [fetch.sources.NAME] in the settings file.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Imagery</source>
      <translation>Bild</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>IMAGERY is a GeoTIFF, a folder of them, or any other source that `geofield tiles` takes.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Lat</source>
      <translation>Geografische Breite</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Latitude of a point in the field, such as 35.0754 or '35 4.524 N'; not needed for the only parcel of --boundary, or one named.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Lon</source>
      <translation>Geografische Länge</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Longitude of a point in the field, such as 33.5311 or '33 31.866 E'; not needed for the only parcel of --boundary, or one named.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Out</source>
      <translation>Ziel</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Folder for the products; made when it does not exist.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Overwrite</source>
      <translation>Überschreiben</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Replace earlier products there; reviewed obstacles and a moved outline are kept.</source>
      <translation>Frühere Ergebnisse dort ersetzen; Durchgesehenes und eine verschobene Feldgrenze bleiben.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Obstacle file</source>
      <translation>Hindernisse</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>File of what is known to stand there: polygons, points with a radius_m, lines.</source>
      <translation>Datei mit bekannten Hindernissen: Flächen, Punkte mit radius_m, Linien.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Fresh</source>
      <translation>Von vorn</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>With --overwrite: forget what a person edited there.</source>
      <translation>Beim Überschreiben: vergessen, was dort von Hand bearbeitet wurde.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Acknowledge terms</source>
      <translation>Bedingungen anerkannt</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>You have permission to derive geodata, though the source's terms forbid it.</source>
      <translation>Sie haben die Erlaubnis, Geodaten abzuleiten, obwohl die Bedingungen der Quelle es verbieten.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Name</source>
      <translation>Name</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>The field's name; its place when not given.</source>
      <translation>Name des Schlags; ohne Angabe sein Ort.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>As json</source>
      <translation>Als JSON</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Print the report as JSON on stdout.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Boundary</source>
      <translation>Grenze</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Your own parcels (any vector file, any CRS): the only one is taken, or the one with the point.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Boundary layer</source>
      <translation>Layer der Grenze</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Layer of --boundary, where it has several.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Boundary name</source>
      <translation>Name des Schlags</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Take the parcel of this name or id instead.</source>
      <translation>Stattdessen den Schlag mit diesem Namen oder dieser Kennung nehmen.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Settings file</source>
      <translation>Einstellungsdatei</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>TOML file with a table per stage; geofield.toml here is read by itself.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>IMAGERY is a picture or any other source that `geofield tiles` takes.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Output</source>
      <translation>Ziel</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>GeoPackage to write; an outline that a person drew in it is kept.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>Replace the output where it exists; an outline drawn by hand is kept.</source>
      <translation>Das Ergebnis ersetzen, wenn es schon da ist; eine von Hand gezeichnete Feldgrenze bleibt.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>List regions</source>
      <translation>Regionen zeigen</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Show the study's numbered regions instead of extracting; draws them with --pictures.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Regions</source>
      <translation>Regionen</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Take this numbered region of the study's method; repeat to join several.</source>
      <translation>Diese nummerierte Region des Verfahrens der Studie nehmen; mehrere, durch Semikolon getrennt, werden verbunden.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Pictures</source>
      <translation>Bilder</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Folder for the study's pictures: grey, binary, numbered regions, reconstruction.</source>
      <translation>Ordner für die Bilder der Studie: grau, binär, nummerierte Regionen, Rekonstruktion.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Alternatives</source>
      <translation>Alternativen</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Show the most likely different outlines; the file's layer alternatives has them.</source>
      <translation>Die wahrscheinlichsten anderen Feldgrenzen zeigen; sie stehen im Layer alternatives der Datei.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Choose</source>
      <translation>Auswahl</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Take this outline of the alternatives: your word, kept on every later run.</source>
      <translation>Diese der anderen Feldgrenzen nehmen: Ihre Entscheidung, die bei jedem weiteren Lauf gilt.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Print what was found as JSON on stdout.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>IMAGERY is the picture that the field was found in.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Plan file</source>
      <translation>Plan</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Rows that a person confirmed, rejected or drew in FIELD.gpkg stay as they are; the settings that it was made with hold where you say nothing else.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>GeoPackage to write; may be the one that was read.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Defaults</source>
      <translation>Voreinstellungen</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Begin with the default settings, not with those that the plan was made with.</source>
      <translation>Mit den Voreinstellungen beginnen, nicht mit denen, mit denen der Plan gemacht wurde.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Replace another file than the one that was read.</source>
      <translation>Auch eine andere Datei als die gelesene ersetzen.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>File</source>
      <translation>Datei</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>FILE is a GeoPackage of geofield, whose field and obstacles count as they are now, with all that a person changed, and whose settings hold where you say nothing else (one of several fields keeps none); or any file of polygons (Shapefile, GeoJSON, GeoPackage, ...), each of which is a field.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>GeoPackage to write, may be FILE of one field; for several fields another one with all of them, or a folder: a farm, as of `geofield batch`.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Each</source>
      <translation>Einzeln</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>A GeoPackage for each of several fields, in a folder.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>CRS of files that do not say theirs, e.g. EPSG:32633.</source>
      <translation>KBS von Dateien, die ihres nicht nennen, z. B. EPSG:32633.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Forget which tracks you took away, changed or drew.</source>
      <translation>Vergessen, welche Fahrspuren Sie entfernt, geändert oder gezeichnet haben.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Replace files that are there already.</source>
      <translation>Dateien ersetzen, die schon da sind.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Print the figures as JSON on stdout.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Source</source>
      <translation>Quelle</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>SOURCE is the name of a source (see `geofield sources`), a tile address with {z}/{x}/{y}, the address of a WMS, WMTS or GeoTIFF, a picture, a folder of pictures, an MBTiles or a STAC file.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>Latitude of the centre.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>Longitude of the centre.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Area</source>
      <translation>Gebiet</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Vector file whose extent is fetched, instead of a square around a point.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Zoom</source>
      <translation>Zoom</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Zoom of tiled sources: a number, max, or fit (the largest at which --size-m or --area fits 640 px); by default as --resolution needs.</source>
      <translation>Zoomstufe von Kachelquellen: eine Zahl, max oder fit (die größte, bei der der Ausschnitt in 640 Pixel passt); sonst so, wie die Auflösung es verlangt.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Resolution (m)</source>
      <translation>Auflösung (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Wanted metres per pixel on the ground, when no zoom is given.</source>
      <translation>Gewünschte Meter je Pixel am Boden, wenn kein Zoom angegeben ist.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Size (px)</source>
      <translation>Größe (px)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Side of the square, pixels.  [default: 640]</source>
      <translation>Seitenlänge des Quadrats, Pixel; sonst 640.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Side of the square, metres on the ground.</source>
      <translation>Seite des Quadrats, Meter am Boden.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Whole tiles</source>
      <translation>Ganze Kacheln</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Keep the touched tiles whole.</source>
      <translation>Berührte Kacheln ganz behalten.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Layer</source>
      <translation>Layer</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Layer of a WMS or WMTS.</source>
      <translation>Layer eines WMS oder WMTS.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Missing</source>
      <translation>Fehlende Kacheln</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>What to do about tiles that cannot be had: stop, or leave no-data.</source>
      <translation>Was bei Kacheln geschieht, die nicht zu haben sind: anhalten (stop) oder ohne Daten lassen (no-data).</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Offline</source>
      <translation>Ohne Netz</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Work from the tile cache alone.</source>
      <translation>Nur mit zwischengespeicherten Kacheln arbeiten.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>No cache</source>
      <translation>Ohne Speicher</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Neither read nor keep tiles.</source>
      <translation>Kacheln weder aus dem Zwischenspeicher lesen noch behalten.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Folder of the tile caches.</source>
      <translation>Ordner für zwischengespeicherte Kacheln.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>The GeoTIFF (COG) to write.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>Replace an existing file.</source>
      <translation>Eine vorhandene Datei ersetzen.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Print what was made as JSON on stdout.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Plan files</source>
      <translation>Plan-Dateien</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>PLAN is a GeoPackage of geofield, the folder of a farm, or any file it can import.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>Format; may be repeated.</source>
      <translation>Formate.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Folder</source>
      <translation>Ordner</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Folder for the products.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>File name</source>
      <translation>Dateiname</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Name of single files.</source>
      <translation>Name einzelner Dateien.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>CRS of PLAN where the file does not say it, e.g. EPSG:32633.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>Picture to show, or a folder of some; by default that beside PLAN, or the farm's.</source>
      <translation>Bild, das gezeigt wird, oder ein Ordner mit Bildern; sonst das neben dem Plan oder das des Betriebs.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Customer</source>
      <translation>Kunde</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Customer's name, for terminals.</source>
      <translation>Name des Kunden, für Terminals.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Farm</source>
      <translation>Betrieb</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Farm's name, for terminals.</source>
      <translation>Name des Betriebs, für Terminals.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Profile</source>
      <translation>Profil</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Names and columns of Shapefiles.</source>
      <translation>Namen und Spalten der Shapefiles.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Zipped</source>
      <translation>Als Archiv</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Shapefiles or ISOXML in one archive.</source>
      <translation>Shapefiles oder ISOXML in einem Archiv.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Track points: by default in the GeoPackage and the study's files, not in other RDF.</source>
      <translation>Spurpunkte: sonst im GeoPackage und in den Dateien der Studie, nicht in anderem RDF.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Further options</source>
      <translation>Weitere Angaben</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Further option of a format.</source>
      <translation>Weitere Option eines Formats.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Replace products that are there already; `geofield undo` brings a GeoPackage back.</source>
      <translation>Ergebnisse ersetzen, die schon da sind; `geofield undo` holt ein GeoPackage zurück.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Print the files as JSON on stdout.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>FILE is a Shapefile, GeoPackage, GeoJSON, KML, GPX, GeoParquet, FlatGeobuf, DXF, ISOXML TASKDATA, AgOpenGPS field, a CSV table with lat and lon (or WKT), or what else GDAL finds shapes in (GML, MapInfo, a file geodatabase), in any CRS.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>GeoPackage to write.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>The field's name.</source>
      <translation>Name des Feldes.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Replace a file that is there already; `geofield undo` brings it back.</source>
      <translation>Eine Datei ersetzen, die schon da ist; `geofield undo` holt sie zurück.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Print the findings as JSON on stdout.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Detected</source>
      <translation>Gefunden</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>TRUTH may be a plan that a person reviewed: what they rejected is no true obstacle.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Distance (m)</source>
      <translation>Abstand (m)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Distance between centres within which a detection is a hit, metres.</source>
      <translation>Abstand der Mitten, bis zu dem ein Fund ein Treffer ist, Meter.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Layer of DETECTED.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Truth layer</source>
      <translation>Layer der Referenz</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Layer of TRUTH; when not given `obstacles`, else its first one.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Driving</source>
      <translation>Fahrweise</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Also what a driver loses: DETECTED is a plan with its field and tracks.</source>
      <translation>Auch, was der Fahrer verliert: die erkannten Hindernisse sind dann ein Plan mit Feld und Fahrspuren.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Seed</source>
      <translation>Startzahl</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Of the bootstrap.</source>
      <translation>Startwert für den Bootstrap.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>PNG to write: hits, misses and false detections.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Scene file</source>
      <translation>Bild</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Picture to draw them on.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>Replace an existing drawing.</source>
      <translation>Eine vorhandene Zeichnung ersetzen.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Places</source>
      <translation>Orte</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>PLACES is a file with a row per field: points (CSV or Parquet with columns lat and lon, or any vector file) or parcels (polygons), whose outlines are taken as they are.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>IMAGERY is whatever `geofield run` takes; parcels need none.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>Folder of the farm, or s3://BUCKET/FOLDER; where it is begun already, only what is missing is done.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Workers</source>
      <translation>Prozesse</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Worker processes on this machine; one per core by default.</source>
      <translation>Prozesse auf diesem Rechner; sonst einer je Kern.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Scheduler</source>
      <translation>Verteiler</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Of a Dask cluster: tcp://HOST:8786.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.json" />
      <source>Plan all anew where the farm is of other work; what a person reviewed stays.</source>
      <translation>Alles neu planen, wenn der Betrieb aus einem anderen Auftrag stammt; was durchgesehen wurde, bleibt.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Overview</source>
      <translation>Übersicht</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Write farm.gpkg and farm.qgz for QGIS at the end.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Retry</source>
      <translation>Noch einmal versuchen</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Try places again that failed or were lost.</source>
      <translation>Orte noch einmal versuchen, die misslangen oder verloren gingen.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Time limit s</source>
      <translation>Zeitgrenze (s)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Of one field, seconds.</source>
      <translation>Für ein Feld, Sekunden.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Memory limit (MB)</source>
      <translation>Speichergrenze (MB)</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Of a worker, megabytes.</source>
      <translation>Für einen Prozess, Megabyte.</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Layer of PLACES, where it has several.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Places crs</source>
      <translation>KBS der Orte</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Id column</source>
      <translation>Spalte der Kennung</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Column of PLACES with the id; usual names are found.</source>
      <translation>Spalte der Orte mit der Kennung; übliche Namen werden gefunden.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Name column</source>
      <translation>Spalte des Namens</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Column of PLACES with the name; usual names are found.</source>
      <translation>Spalte der Orte mit dem Namen; übliche Namen werden gefunden.</translation>
    </message>
    <message>
      <location filename="description.py" />
      <source>Lat column</source>
      <translation>Spalte der Breite</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Column of PLACES with the lat; usual names are found.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="description.py" />
      <source>Lon column</source>
      <translation>Spalte der Länge</translation>
    </message>
    <message>
      <location filename="description.json" />
      <source>Column of PLACES with the lon; usual names are found.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <location filename="results.py" />
      <source>Field</source>
      <translation>Feld</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Outline</source>
      <translation>Feldgrenze</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Outline to be checked</source>
      <translation>Zweifelhafte Feldgrenze</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Field to be checked</source>
      <translation>Zweifelhaftes Feld</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Obstacles</source>
      <translation>Hindernisse</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Confirmed</source>
      <translation>Bestätigt</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Possible, not avoided</source>
      <translation>Möglich, nicht umfahren</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Added by a person</source>
      <translation>Von Hand ergänzt</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Rejected by a person</source>
      <translation>Von Hand verworfen</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Tracks</source>
      <translation>Fahrspuren</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Track</source>
      <translation>Fahrspur</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Segments</source>
      <translation>Abschnitte</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Segment</source>
      <translation>Abschnitt</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Gaps</source>
      <translation>Lücken</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Gap</source>
      <translation>Lücke</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Track points</source>
      <translation>Spurpunkte</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Track point</source>
      <translation>Spurpunkt</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Headland</source>
      <translation>Vorgewende</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Headland tracks</source>
      <translation>Fahrspuren im Vorgewende</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Headland track</source>
      <translation>Fahrspur im Vorgewende</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Turns</source>
      <translation>Wendungen</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Turn</source>
      <translation>Wendung</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Turn that does not fit</source>
      <translation>Wendung, die nicht passt</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Outline that may be meant</source>
      <translation>Mögliche Feldgrenze</translation>
    </message>
    <message>
      <location filename="results.py" />
      <source>Place without a plan</source>
      <translation>Ort ohne Plan</translation>
    </message>
  </context>
</TS>
