"""Words that what stands beside a table is made of, where they are known to leave its numbers as they are; and others.

A word that is not here is not known. A star stands for any letters; accents are left out, and a word is in lower case.
"""

from __future__ import annotations

import re


def lexicon(*text: str) -> re.Pattern[str]:
    """Pattern of one of several words, with blanks between them, in which a star stands for any letters.

    Parameters
    ----------
    *text : str
        Words with blanks between them.
    """
    words = sorted({word for part in text for word in part.split()})
    return re.compile("|".join(word.replace("*", r"[^\W\d_]*") for word in words))


#: Words that join others, by language.
GLUE = (
    "yes no on off none true false positive positiv ja nein aus ein more a an the of in at to from by with and or for"
    " as is are was were be been has have had it its this that these those there here then after before during while"
    " when until since between under above below over behind beside near into via which who whose where all any every"
    " some new old",
    "der die das den dem des ein eine einer eines einem einen und oder mit von vom zu zum zur im am an auf bei nach"
    " vor aus fur durch uber unter ist sind war waren wurde wurden wird werden hat haben als wie es sich je pro",
    "le la les l d de du des un une et ou avec par pour dans sur sous est sont au aux en ce cette s y el los las del"
    " con por para es son al il lo i gli di della dei e o su da alla dal",
    "v ve na z ze se do od pri po je jsou byl byla bylo w we przy dla jest sa",
)
#: What owns a number, or is set: people, dates, places, parts, settings; and what is done without changing numbers.
OWNERS = (
    # people, dates, papers, files
    "operator* bediener operateur operador operatore author* autor* user* benutzer experimenter student* team group"
    " gruppe department institut* university laborator* labor lab customer client* kunde company firma vendor"
    " manufacturer hersteller make date* datum day* tag monday tuesday wednesday thursday friday saturday sunday"
    " montag dienstag mittwoch donnerstag freitag fecha year month jan january januar feb february februar mar apr"
    " april may jun* jul* aug* sep* oct* nov* dec december dez dezember hour* stunde* uhr am pm utc gmt cet cest"
    " timezone zone created modified saved exported export printed written recorded acquired logged stored started"
    " stopped generated measured performed carried conducted taken captured title titel name* bezeichnung file* datei"
    " fichier archivo folder path directory project* projekt* order* auftrag* job report protocol protokoll*"
    " prufprotokoll test* *test* versuch* *versuch prufung* pruf* *prufung essai* ensayo* prova zkouska zkousk* pokus"
    " mereni proba pomiar run* trial* experiment* session* repeat repetition* campaign serie* no nr n number nummer"
    " numero cislo id uuid serial s/n sn certificate* zertifikat kalibrierschein schein norm* standard* iso din astm"
    " en uiaa ce version revision rev release firmware software program* programm driver build hardware model* modell"
    " modelo type typ* series class klasse grade page* sheet* blatt line* zeile* row* columns record* messung*"
    " datensatz dataset set sets block* segment* section* event* marker* trigger* triggered pretrigger posttrigger pre"
    " post flag* status state* mode* phase* stage* cycle* zyklus step* schritt* ok ready done start* begin* end* stop*"
    " first last next previous second third fourth fifth source origin topic host station site place ort room raum"
    " city street web www http* mail email tel phone license copyright reserved rights drop* fall* falls catch jump*"
    " swing* impact* impactor* release* released hit* loading unloading relaxation creep hold ramp dwell preload*"
    " pretension* prestress vorlast vorkraft vorspann* warm* setup preset aufbau configuration config* settings"
    " setting einstellung* parameter* info* information general summary results result ergebnis* header head kopf"
    " footer comment* kommentar bemerkung* remark* note* notiz* poznamka description beschreibung descr text label*"
    " legend legende key* value* wert* data daten donnees datos dati words",
    # chain of measurement
    "sensor* sensors transducer* aufnehmer *aufnehmer capteur sensore cell* *zelle loadcell* laser* encoder* lvdt"
    " potentiometer camera* kamera daq* logger* datalogger recorder* scope* oscilloscope instrument* gerat* device*"
    " module* modul amplifier* amp verstarker *verstarker preamp* bridge brucke excitation supply speisung batter*"
    " voltage spannung power mains channel* kanal* kanale canal* chan ch voie ai ao di input* output* eingang*"
    " ausgang* port pin slot cable kabel connector usb ethernet com baud bus ip address adc bit bits resolution*"
    " auflosung accuracy genauigkeit precision linearity hysteresis uncertainty noise rauschen rms rated capacity cap"
    " nennlast nennkraft nennwert range* bereich* messbereich *bereich measuring span limit* grenz* overload"
    " protection safe breaking strength alarm sensitivity kennwert empfindlichkeit bandwidth bandbreite filter*"
    " gefiltert *filter tiefpass* lowpass highpass bandpass notch low high pass cut cutoff corner bessel butterworth"
    " chebyshev anti aliasing antialias* fir iir median smoothing oversampling bandstop grenzfrequenz carrier"
    " frequency frequenz frekvence frequence* frecuencia freq fs rate messrate abtastrate datenrate bildrate scanrate"
    " framerate baudrate sample* sampled sampling abtast* vzorkovac* echantillonnage muestreo acquisition acquire*"
    " erfassung scan* interval* intervall* *intervall period* periode dt delta increment* inc xinc tinc timebase"
    " zeitbasis zeitschritt schrittweite samplerate sampletime sps ksps fps frame* bild* hz khz duration dauer *dauer"
    " length* lange* *lange laenge points punkte anzahl size buffer memory speicher depth total values waveform*"
    " trace* curve* signal* plot* diagram graph chart axis achse x y z horizontal vertical unit units einheit* unite*"
    " unidad* jednotk* format decimal* separator delimiter encoding checksum crc hash terminal rse differential diff"
    " single ended coupling dc ac impedance probe* div display refresh update screen monitor language locale region",
    # specimen, rig, surroundings
    "specimen* *probe prufling* prufkorper muster material* werkstoff product produkt batch charge lot rope* seil*"
    " *seil corde cuerda lano lina cord* kernmantel strap webbing sling string* fibre* fiber* faser* yarn wire* draht"
    " chain kette spring* feder* knot* knoten splice* eye* hook* haken *haken carabiner* karabiner anchor* bolt*"
    " schraube* screw* shackle* pulley* rolle *rolle sheave seilscheibe clamp* klemme grip* jaw* fixture* fixation"
    " rahmen beam rig* bench *stand machine maschine tester crosshead traverse table tisch bearing lager guide*"
    " fuhrung carriage schlitten cart* wagen track rail schiene mass* masse* *masse gewicht* weight* hmotnost poids"
    " peso masa massa bob pendulum pendel plate* platte cylinder zylinder piston kolben damper dampfer drum motor*"
    " height* hohe *hohe hauteur altura vyska altezza diameter* durchmesser *durchmesser prumer thickness dicke width"
    " breite area flache *flache cross querschnitt gauge gage radius volume density dichte modulus young* stiffness"
    " steifigkeit elongation dehnung bruchdehnung slack taut speed* velocity geschwindigkeit *geschwindigkeit vitesse"
    " velocidad rychlost stroke energy energie torque moment temperature* temperatur* teplota humidity feuchte"
    " *feuchte luft* air pressure *druck ambient climate weather dry dried wet nass trocken conditioned conditioning"
    " inclination neigung incline* gravity g distance abstand arm upper lower top bottom oben unten left right links"
    " rechts front rear middle ends inner outer colour color red blue green yellow black white nylon polyamide pa"
    " polyester pes dyneema aramid kevlar steel stahl edelstahl alu* aluminium aluminum static dynamic semi"
    " halbstatisch statisch dynamisch braid* braided strands twisted laid kern coated sheath core mantle kg lb kistler"
    " hbm hbk futek mts zwick* roell instron shimadzu keyence micro epsilon national instruments ni labview matlab"
    " python numpy arduino esp teensy raspberry spider mgc* catman quantum* catmanfile qb dewesoft dewetron hioki"
    " yokogawa tektronix keysight rigol siglent lecroy picoscope campbell vernier phyphox",
    # what instruments print
    "tolerance* celda zoom words tot chan std stdev index idx subject relative ts sr e kp ki kd d l annotation* log"
    " timed column columns count storing energy energie atf seq sequence samples usec exported thu thurs* mon tue wed"
    " fri sat sun vision vom col spalte third point trig determined first º zmk trace lsb j controller* pid regler"
    " meta history down downwards up upwards excel variable* fc order milliseconds microseconds seconds minutes hours"
    " len mso dso msox dsox oscilloscop* amplitude* nyquist due valid until expires expiry unused included total used"
    " duty gps fmin fmax max* min minimum mean avg peak* valley tup lift missing nodata nan xorg xstart xstop stamp"
    " stamps smp rst boot reset poweron daylight saving shear pin inch see drawing laboratory model root quality local"
    " timecode degrees factory auto autom* fast reference strand leg analog analogue digital volt volts newton newtons"
    " long infinii lecroy* scopy bio ware toa mpt enu wf hresolution timeaxis hoffset hunit vunit voffset dkd"
    " ruckfuhrung dakks ukas traceab* accredited person weighed aborted spec specs divisions secs msec carga cellule"
    " chute usi acq dxd csv txt tdms bin linear interp interpolation vertical noise kommastellen nachkommastellen"
    " hersteller messprinzip principle method methode verfahren purpose zweck goal aim objective ziel humid* rel rh"
    " degc weather wind window open closed quiet vibration* isolation base floor ground earth cpu ram os windows linux"
    " mac uptime init initial final checks passed pass go calibre cond supply mounted montiert befestigt installed"
    " placed hanging vertically horizontally attached fixed fastened tied traction zug druckseite compression"
    " pretensioned visually inspected",
    "throughput measurement* measur* bearbeiter mitarbeiter raumtemperatur umgebungstemperatur excel variable* fc"
    " order milliseconds microseconds seconds minutes hours len mso dso oscilloscop* amplitude* nyquist due valid"
    " until expires expiry unused",
    "longueur diametre longitud lunghezza diametro caida caduta chute delka dlugosc srednica wysokosc hloubka sirka"
    " prurez zkusebni teplota data heure hora ora hmotnost masa massa waga ciezar zavazi obsluha datum zkouska lana"
    " lano lina liny corde corda cuerda neuf neuve nueva nuevo nuova nuovo nova novy nove c p cislo mistnost laborator"
    " vlhkost humidite humedad umidita wilgotnosc tlak pression presion pressione cisnienie ambient* okoli otoczenia"
    " essai prueba prova proba echantillon muestra provino vzorek probka machine maquina macchina stroj maszyna"
    " fichier archivo plik soubor vitesse velocidad velocita rychlost predkosc frequence frecuencia frequenza"
    " czestotliwosc kmitocet filtre filtro filtr capteur sensore czujnik snimac cella etendue portee portata rozsah"
    " zakres plage gamme poulie polea puleggia kladka krazek electromagnet elektromagnet elektromagnes solenoid latch"
    " dummy climber belay* device quickdraw* karabina uzel wezel noeud nudo nodo temperatura altura altezza hauteur"
    " vyska",
    "labview view",
    "code temp strain ohm free figure eyelet loop initials institute centre center facility plant hall halle"
    " raumnummer building floor weather sky sunny rain cloudy",
    "build sw hw video videos photo* foto* image* picture* mp jpg rssi dbm license licence oil refilled iso vg"
    " disabled enabled bungee bowline differential kept inspector teensy sps fps attempt meters metres stopper hits"
    " clamp jaws satellite altitude latitude longitude lat lon alt bluetooth wifi channelname elapsed since speed head"
    " grip separation iepe rg booster beal mammut edelrid petzl tendon lanex svk",
    "bm img",
    "sag internal external complete completed messkanal kraftaufnehmer wegaufnehmer laborator zkusebni zdm vut"
    " messkette einspannlange einspann* betriebsart prufstelle auftragsnummer seriennummer gerat geratenummer",
    "wa",
    "pandas host computer pc *sensor rows written degrees",
    "gestartet beendet gemessen",
    "logging months month age hpa mbar rh campionamento hersteller contact phone stopwatch melting extensometer none"
    " mtd admin",
    "h",
    "location comma list witness tags interface wiederholung* fallweg federweg bremsweg hall messgerat messrate"
    " seiltyp reepschnur prufmasse machine quasar galdabini",
    "genauigkeitsklasse nennkraft nennweg",
    "mittelwert maximalwert minimalwert standardabweichung",
    "rest nano arduino",
)
#: What of a quantity owns a number that is no reading of it, in the same claim as its name.
NOT_READ = (
    "celda column* spalte* fallweg federweg bremsweg *sensor snimac* czujnik* capteur* sensore* len crosshead"
    " traverse ai ch range* vorkraft pull* capacity rated sensor* cell* *zelle transducer* limit* overload preload"
    " pretension vorlast breaking impact noise resolution* accuracy rate speed step* stop* max* min* peak* fmax fmin"
    " mean avg valley mittelwert filter* bandwidth trigger* mass* hohe *hohe height channel* kanal* kan* interval*"
    " intervall* *intervall sampling sample* sampled duration dauer record* recording test* stamp* increment* inc"
    " division div axis zone step base start* end* messrate abtastrate datenrate bildrate scanrate framerate baudrate"
    " unit units einheit* acquisition points number bereich messbereich *bereich aufnehmer *aufnehmer nennwert"
    " kennwert sensitivity kraftaufnehmer wegaufnehmer class klasse frame* plate* id nr no serial model* type typ*"
    " laser* encoder* lvdt camera* logger* period* header*"
)
#: Positions of a key behind which names stand.
NAMES = lexicon(
    "operator* bediener operateur operador operatore author* autor* user* benutzer student* institut* university"
    " laborator* labor lab customer client* kunde company firma vendor manufacturer hersteller make title titel name*"
    " bezeichnung file* datei fichier archivo folder path project* projekt* auftrag* order specimen* *probe prufling*"
    " material* werkstoff product produkt rope* seil* *seil corde cuerda lano lina cord* knot* machine maschine"
    " sensor* transducer* cell* *zelle aufnehmer *aufnehmer capteur laser* encoder* camera* daq* logger* recorder*"
    " scope* instrument* gerat* device* module* modul amplifier* amp *verstarker verstarker model* modell type typ*"
    " software program* programm firmware version revision serial id source origin topic host station site place ort"
    " room raum city rig* *stand bench prufer pruefer tester hook* anchor* clamp* grip* event* marker* status state*"
    " label* subject format normen norm* prufnorm standard* no nr filter* channel* ch signal* trace* fixture* plate*"
    " test* versuch* essai* ensayo* run* job created by written stroj maszyna maquina macchina zarizeni laboratorium"
    " trigger* mode* phase* segment* terminal fecha mts* hbm hbk toa lecroy* infinii kistler futek instron zwick*"
    " yokogawa hioki keysight tektronix rigol siglent gps"
)
#: Words of a change that are at home in a head, where something else says what becomes of it.
TECHNICAL = lexicon(
    "scal* skalier* factor* faktor* calib* cal kalib* kalibr* gain* verstarkung ratio* slope* intercept offset* zero*"
    " null* tare* tara balance* baseline bias drift* shift* delay* lag* latency skew compensat* coefficient* coeff*"
    " koeff* correct* korrek* polarit* sign vorzeichen invert* conver* umrechn* attenuat* dampf* damping decimat*"
    " averag* gemittelt raw unfiltered linear* autozero autoscale exponent clock timer tick* shunt multiplier"
    " coefficient",
    # and what is said of them once they are done
    "subtract* removed applied already eliminated considered accounted deducted cancelled abgezogen angewendet"
    " angewandt berucksichtigt eingerechnet enthalten korrigiert kompensiert tared zeroed nulled genullt tariert"
    " bereits missing",
)
#: Words of a change wherever they stand, with nothing else known in a sentence.
CHANGES = lexicon(
    "scal* rescal* factor* faktor* multipl* divid* divis* convert* calibrat* uncalib* gain* amplif* attenuat* lever*"
    " offset* zero* tare* untared bias* shift* drift* subtract* deduct* invert* inverted negat* negativ* revers* flip*"
    " mirror* opposite upside swap* swopp* exchang* interchang* confus* wrong* mistak* erron* incorrect* error* should"
    " must instead half* halv* doubl* twice tripl* percent* averag* decimat* thinn* skip* omit* missing lost delay*"
    " lag lags lagged lagging late slow* stretch* overestim* underestim* too unreliable broken defect* unplugged"
    " disconnect* not never yet beware careful attention",
    "skalier* umrechn* umgerechn* verstark* gedampft hebel* versatz nullpunkt* abzieh* abzuzieh* abgezog* addier*"
    " invertier* negativ* umgekehrt* umgedreht* verdreht* vertausch* verwechs* gespiegelt falsch* irrtum* irrtumlich*"
    " versehentlich statt anstatt soll* muss* mussen halb* doppelt* verdoppel* dreifach* zehnfach* prozent* gemittelt"
    " ausgedunnt jede* fehl* verloren verzoger* verspat* zu langsam* gedehnt nicht kein* nie noch achtung vorsicht mal"
    " geteilt kalibrier* unkalibriert tariert* genullt* korrigier*",
    "facteur* multipli* divis* converti* etalonn* calibr* inverse* invers* negatif* oppose* echang* faux fausse"
    " erreur* doit devrait lieu moitie double* triple* pourcent moyenn* decim* manqu* perdu* retard* ralenti pas non"
    " jamais encore tarer tare decalage corrig* soustrai* attention echelle",
    "factor* multiplic* dividi* dividir convers* calibr* ganancia invert* negativ* opuest* intercambi* equivoc*"
    " erron* debe* lugar mitad doble* triple* porcentaje promedi* diezm* falta* perdid* retras* lento nunca aun tara"
    " desplaz* corrig* restar atencion escala",
    "fattore* moltiplic* divid* converti* tarat* calibr* guadagno invert* negativ* oppost* scambi* sbagliat* errat*"
    " errore deve dovrebbe invece doppi* tripl* percento mediat* decimat* manca* perso ritard* lento non mai ancora"
    " azzer* corrett* sottra* attenzione scala",
    "nasob* vynasob* delen* delit* vydel* prevod* prepoct* kalibr* zesilen* obracen* opacn* zaporn* prehozen*"
    " zamenen* spatn* chyb* omyl* misto musi polovi* dvoj* dvakrat trikrat procent* prumer* vynech* chybi ztrac*"
    " zpozd* pomal* neni nebyl* jeste pozor tara tarov* posun* odecist odecten* nekalibr* desetin* setin* krat"
    " znamenk*",
    "mnoz* pomnoz* podziel* dziel* przelicz* kalibr* wzmocn* odwroc* odwrotn* ujemn* zamien* zle bledn* blad* omylk*"
    " zamiast powin* musi* polow* podwoj* dwukrot* procent* sredn* pomin* brak opozn* spowoln* nie jeszcze uwaga tara"
    " przesun* odjac",
    "minus moins menos meno doubled backwards upside tackle",
    "plus",
)
#: Of these, what heads a column of a list of channels.
LABELS = lexicon(
    "factor* faktor* gain* offset* zero* slope* intercept scale scaling invert* calibration unit* raw null"
)
#: Of these, what was done where a switch says yes.
SWITCHED = lexicon(
    "calib* kalib* balance* shunt temperature coefficient tare* tara* zero* null* compensat* autozero offset*"
    " correct* korrek* linear* autoscale gain*"
)
#: Of these, what a certificate tells of.
CERTIFIED = lexicon("calib* kalib* cal kal")
#: What has a word of a change in it and is none.
PHRASES = re.compile(
    r"(?:\+/-|\u00b1)|\b(?:missing values?|no ?data value|(?:per|pro) (?:second|sekunde)|scale divisions?|and +\d+ more"
    r"|raw data|rohdaten|reading mode|every sample stored|all samples|some words|real[- ]?time|no averag\w*"
    r"|(?:laboratory|kitchen|digital) scale|gain set by factory|offset of the laser from the axis|not used"
    r"|[\w-]+\.(?:jpe?g|png|mp4|mov|avi|csv|txt|dat|py|m|vi|log|xlsx?)|[a-z]+_\d+|(?-i:[A-Z]{1,6}-\d{2,}[A-Z]*)"
    r"|temperature coefficient of \w+\W+[\d.]+ ?\S*|since (?:19|20)\d\d|type?\W+(?:double|single)\b"
    r"|averaging\W+(?=median)|median +\d+|0x[0-9a-f]+|\d+-(?!fold|times|fach|mal)[a-z]{4,}|\d{4}[A-MO-Z]{1,2}"
    r"|(?:vertical|horizontal) (?:position|scale|offset|delay)|(?:units?|values?) after scaling"
    r"|(?:double|three|two)[- ]?(?:click|core))\b",
    re.I,
)
#: Words of how the rows came about, where what is said is not of one channel.
OF_TIMES = lexicon(
    "casov* ran speed tape replay replayed throughput turn divider divisor prescaler skip* decimat* thinn* every nth"
    " interval* rate* samples sampled sampling resampl* downsampl* subsampl* undersampl* abtast* messrate abtastrate"
    " datenrate bildrate scanrate framerate baudrate scan* frame* fps clock tick* timer time* zeit* playback slow*"
    " seconds minute* jede* kazdy kazda row* rows zeile* hz khz",
    "shorter baud crystal",
)
#: Words of a claim that tells how often rows were taken, and nothing else.
OF_THE_RATE = lexicon(
    "sample* sampling rate frequency freq interval period scan scanning acquisition logging logger log data daq"
    " recording record measuring measurement samplerate abtastrate abtastfrequenz abtastintervall abtastzeit abtastung"
    " messrate messintervall messfrequenz fs dt ts delta t campionamento frequence frequenza frecuencia muestreo"
    " echantillonnage vzorkovaci vzorkovani speed time step of at was the is with"
)
