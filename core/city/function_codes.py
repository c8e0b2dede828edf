"""What codes of functions of buildings mean, of the two lists that name themselves.

Germany's surveying authorities (AdV, GeoInfoDok, AX_Gebaeude.gebaeudefunktion) write 31001_1000;
CityGML's own list (OGC 12-019, annex C) is meant where the codeSpace names it. Codes of other lists
stay as they are: the same number means something else in each.
"""

import re
from functools import cache

ADV = """
1000 Wohngebäude | 1010 Wohnhaus | 1020 Wohnheim | 1021 Kinderheim | 1022 Seniorenheim
1023 Schwesternwohnheim | 1024 Studenten-, Schülerwohnheim | 1025 Schullandheim
1100 Gemischt genutztes Gebäude mit Wohnen | 1110 Wohngebäude mit Gemeinbedarf
1120 Wohngebäude mit Handel und Dienstleistungen | 1121 Wohn- und Verwaltungsgebäude
1122 Wohn- und Bürogebäude | 1123 Wohn- und Geschäftsgebäude
1130 Wohngebäude mit Gewerbe und Industrie | 1131 Wohn- und Betriebsgebäude
1210 Land- und forstwirtschaftliches Wohngebäude
1220 Land- und forstwirtschaftliches Wohn- und Betriebsgebäude | 1221 Bauernhaus
1222 Wohn- und Wirtschaftsgebäude | 1223 Forsthaus | 1310 Gebäude zur Freizeitgestaltung
1311 Ferienhaus | 1312 Wochenendhaus | 1313 Gartenhaus
2000 Gebäude für Wirtschaft oder Gewerbe | 2010 Gebäude für Handel und Dienstleistungen
2020 Bürogebäude | 2030 Kreditinstitut | 2040 Versicherung | 2050 Geschäftsgebäude
2051 Kaufhaus | 2052 Einkaufszentrum | 2053 Markthalle | 2054 Laden | 2055 Kiosk
2056 Apotheke | 2060 Messehalle | 2070 Gebäude für Beherbergung | 2071 Hotel, Motel, Pension
2072 Jugendherberge | 2073 Hütte (mit Übernachtungsmöglichkeit) | 2074 Campingplatzgebäude
2080 Gebäude für Bewirtung | 2081 Gaststätte, Restaurant
2082 Hütte (ohne Übernachtungsmöglichkeit) | 2083 Kantine | 2090 Freizeit- und Vergnügungsstätte
2091 Festsaal | 2092 Kino | 2093 Kegel-, Bowlinghalle | 2094 Spielkasino | 2095 Spielhalle
2100 Gebäude für Gewerbe und Industrie | 2110 Produktionsgebäude | 2111 Fabrik
2112 Betriebsgebäude | 2113 Brauerei | 2114 Brennerei | 2120 Werkstatt | 2121 Sägewerk
2130 Tankstelle | 2131 Waschstraße, Waschanlage, Waschhalle | 2140 Gebäude für Vorratshaltung
2141 Kühlhaus | 2142 Speichergebäude | 2143 Lagerhalle, Lagerschuppen, Lagerhaus
2150 Speditionsgebäude | 2160 Gebäude für Forschungszwecke
2170 Gebäude für Grundstoffgewinnung | 2171 Bergwerk | 2172 Saline
2180 Gebäude für betriebliche Sozialeinrichtung
2200 Sonstiges Gebäude für Gewerbe und Industrie | 2210 Mühle | 2211 Windmühle
2212 Wassermühle | 2213 Schöpfwerk | 2220 Wetterstation
2310 Gebäude für Handel und Dienstleistung mit Wohnen
2320 Gebäude für Gewerbe und Industrie mit Wohnen
2400 Betriebsgebäude zu Verkehrsanlagen | 2410 Betriebsgebäude für Straßenverkehr
2411 Straßenmeisterei | 2412 Wartehalle | 2420 Betriebsgebäude für Schienenverkehr
2421 Bahnwärterhaus | 2422 Lokschuppen, Wagenhalle | 2423 Stellwerk, Blockstelle
2424 Betriebsgebäude des Güterbahnhofs | 2430 Betriebsgebäude für Flugverkehr
2431 Flugzeughalle | 2440 Betriebsgebäude für Schiffsverkehr | 2441 Werft (Halle)
2442 Dock (Halle) | 2443 Betriebsgebäude zur Schleuse | 2444 Bootshaus
2450 Betriebsgebäude zur Seilbahn | 2451 Spannwerk zur Drahtseilbahn | 2460 Gebäude zum Parken
2461 Parkhaus | 2462 Parkdeck | 2463 Garage | 2464 Fahrzeughalle | 2465 Tiefgarage
2500 Gebäude zur Versorgung | 2501 Gebäude zur Energieversorgung
2510 Gebäude zur Wasserversorgung | 2511 Wasserwerk | 2512 Pumpstation | 2513 Wasserbehälter
2520 Gebäude zur Elektrizitätsversorgung | 2521 Elektrizitätswerk | 2522 Umspannwerk
2523 Umformer | 2527 Reaktorgebäude | 2528 Turbinenhaus | 2529 Kesselhaus
2540 Gebäude für Fernmeldewesen | 2560 Gebäude an unterirdischen Leitungen
2570 Gebäude zur Gasversorgung | 2571 Gaswerk | 2580 Heizwerk
2590 Gebäude zur Versorgungsanlage | 2591 Pumpwerk (nicht für Wasserversorgung)
2600 Gebäude zur Entsorgung | 2610 Gebäude zur Abwasserbeseitigung
2611 Gebäude der Kläranlage | 2612 Toilette | 2620 Gebäude zur Abfallbehandlung
2621 Müllbunker | 2622 Gebäude zur Müllverbrennung | 2623 Gebäude der Abfalldeponie
2700 Gebäude für Land- und Forstwirtschaft | 2720 Land- und forstwirtschaftliches Betriebsgebäude
2721 Scheune | 2723 Schuppen | 2724 Stall | 2726 Scheune und Stall
2727 Stall für Tiergroßhaltung | 2728 Reithalle | 2729 Wirtschaftsgebäude | 2732 Almhütte
2735 Jagdhaus, Jagdhütte | 2740 Treibhaus, Gewächshaus | 2741 Treibhaus
2742 Gewächshaus, verschiebbar | 3000 Gebäude für öffentliche Zwecke | 3010 Verwaltungsgebäude
3011 Parlament | 3012 Rathaus | 3013 Post | 3014 Zollamt | 3015 Gericht
3016 Botschaft, Konsulat | 3017 Kreisverwaltung | 3018 Bezirksregierung | 3019 Finanzamt
3020 Gebäude für Bildung und Forschung | 3021 Allgemein bildende Schule
3022 Berufsbildende Schule | 3023 Hochschulgebäude (Fachhochschule, Universität)
3024 Forschungsinstitut | 3030 Gebäude für kulturelle Zwecke | 3031 Schloss
3032 Theater, Oper | 3033 Konzertgebäude | 3034 Museum | 3035 Rundfunk, Fernsehen
3036 Veranstaltungsgebäude | 3037 Bibliothek, Bücherei | 3038 Burg, Festung
3040 Gebäude für religiöse Zwecke | 3041 Kirche | 3042 Synagoge | 3043 Kapelle
3044 Gemeindehaus | 3045 Gotteshaus | 3046 Moschee | 3047 Tempel | 3048 Kloster
3050 Gebäude für Gesundheitswesen | 3051 Krankenhaus
3052 Heilanstalt, Pflegeanstalt, Pflegestation | 3053 Ärztehaus, Poliklinik
3054 Rettungswache | 3060 Gebäude für soziale Zwecke | 3061 Jugendfreizeitheim
3062 Freizeit-, Vereinsheim, Dorfgemeinschafts-, Bürgerhaus | 3063 Seniorenfreizeitstätte
3064 Obdachlosenheim | 3065 Kinderkrippe, Kindergarten, Kindertagesstätte
3066 Asylbewerberheim | 3070 Gebäude für Sicherheit und Ordnung | 3071 Polizei
3072 Feuerwehr | 3073 Kaserne | 3074 Schutzbunker | 3075 Justizvollzugsanstalt
3080 Friedhofsgebäude | 3081 Trauerhalle | 3082 Krematorium | 3090 Empfangsgebäude
3091 Bahnhofsgebäude | 3092 Flughafengebäude | 3094 Gebäude zum U-Bahnhof
3095 Gebäude zum S-Bahnhof | 3097 Gebäude zum Busbahnhof | 3098 Empfangsgebäude Schifffahrt
3100 Gebäude für öffentliche Zwecke mit Wohnen | 3200 Gebäude für Erholungszwecke
3210 Gebäude für Sportzwecke | 3211 Sport-, Turnhalle | 3212 Gebäude zum Sportplatz
3220 Badegebäude | 3221 Hallenbad | 3222 Gebäude im Freibad | 3230 Gebäude im Stadion
3240 Gebäude für Kurbetrieb | 3241 Badegebäude für medizinische Zwecke | 3242 Sanatorium
3260 Gebäude im Zoo | 3261 Empfangsgebäude des Zoos | 3262 Aquarium, Terrarium, Voliere
3263 Tierschauhaus | 3264 Stall im Zoo | 3270 Gebäude im botanischen Garten
3271 Empfangsgebäude des botanischen Gartens | 3272 Gewächshaus (Botanik)
3273 Pflanzenschauhaus | 3280 Gebäude für andere Erholungseinrichtung | 3281 Schutzhütte
3290 Touristisches Informationszentrum | 9998 Nach Quellenlage nicht zu spezifizieren
"""
CITYGML = """
1000 residential building | 1010 tenement | 1020 hostel
1030 residential and administration building | 1040 residential and office building
1050 residential and business building | 1060 residential and plant building
1070 agrarian and forestry building | 1080 residential and commercial building
1090 forester's lodge | 1100 holiday house | 1110 summer house | 1120 office building
1130 credit institution | 1140 insurance | 1150 business building | 1160 department store
1170 shopping centre | 1180 kiosk | 1190 pharmacy | 1200 pavilion | 1210 hotel
1220 youth hostel | 1230 campsite building | 1240 restaurant | 1250 canteen
1260 recreational site | 1270 function room | 1280 cinema | 1290 bowling alley | 1300 casino
1310 industrial building | 1320 factory | 1330 workshop | 1340 petrol station
1350 washing plant | 1360 cold store | 1370 depot | 1380 building for research purposes
1390 quarry | 1400 salt works | 1410 miscellaneous industrial building | 1420 mill
1430 windmill | 1440 water mill | 1450 bucket elevator | 1460 weather station
1470 traffic assets office | 1480 street maintenance | 1490 waiting hall
1500 signal control box | 1510 engine shed | 1520 signal box or stop signal
1530 plant building for air traffic | 1540 hangar | 1550 plant building for shipping
1560 shipyard | 1570 dock | 1580 plant building for canal lock | 1590 boathouse
1600 plant building for cablecar | 1610 multi-storey car park | 1620 parking level
1630 garage | 1640 vehicle hall | 1650 underground garage | 1660 building for supply
1670 waterworks | 1680 pump station | 1690 water basin | 1700 electric power station
1710 transformer station | 1720 converter | 1730 reactor | 1740 turbine house
1750 boiler house | 1760 building for telecommunications | 1770 gas works | 1780 heat plant
1790 pumping station | 1800 building for disposal | 1810 building for effluent disposal
1820 building for filter plant | 1830 toilet | 1840 rubbish bunker
1850 building for rubbish incineration | 1860 building for rubbish disposal
1870 building for agrarian and forestry | 1880 barn | 1890 stall | 1900 equestrian hall
1910 alpine cabin | 1920 hunting lodge | 1930 arboretum | 1940 glass house
1950 moveable glass house | 1960 public building | 1970 administration building
1980 parliament | 1990 guildhall | 2000 post office | 2010 customs office | 2020 court
2030 embassy or consulate | 2040 district administration | 2050 district government
2060 tax office | 2070 building for education and research | 2080 comprehensive school
2090 vocational school | 2100 college or university | 2110 research establishment
2120 building for cultural purposes | 2130 castle | 2140 theatre or opera
2150 concert building | 2160 museum | 2170 broadcasting building | 2180 activity building
2190 library | 2200 fort | 2210 religious building | 2220 church | 2230 synagogue
2240 chapel | 2250 community centre | 2260 place of worship | 2270 mosque | 2280 temple
2290 convent | 2300 building for health care | 2310 hospital
2320 healing centre or care home | 2330 health centre or outpatients clinic
2340 building for social purposes | 2350 youth centre | 2360 seniors centre
2370 homeless shelter | 2380 kindergarten or nursery | 2390 asylum seekers home
2400 police station | 2410 fire station | 2420 barracks | 2430 bunker
2440 penitentiary or prison | 2450 cemetery building | 2460 funeral parlour
2470 crematorium | 2480 train station | 2490 airport building
2500 building for underground station | 2510 building for tramway
2520 building for bus station | 2530 shipping terminal
2540 building for recuperation purposes | 2550 building for sport purposes
2560 sports hall | 2570 building for sports field | 2580 swimming baths
2590 indoor swimming pool | 2600 sanatorium | 2610 zoo building | 2620 green house
2630 botanical show house | 2640 bothy | 2650 tourist information centre | 2700 others
"""


def word_of_function(text, space=""):
    """What a file says a building is for, in words: ``Wohnhaus (31001_1010)``; the text itself
    where nothing tells its list, of an address of INSPIRE its last word.

    Parameters
    ----------
    text : str
    space : str
        The codeSpace that the file gives with it.
    """
    if re.match(r"https?://", text):
        return text.rstrip("/").rpartition("/")[2]
    number = re.fullmatch(r"(31001_)?(\d{4})", text)
    if number and (number[1] or re.search(r"\badv\b", space.lower())):
        word = _read_list(ADV).get(number[2])
    elif number and re.search(r"citygml|sig3d|opengis", space.lower()):
        word = _read_list(CITYGML).get(number[2])
    else:
        return text
    return f"{word} ({text})" if word else text


@cache
def _read_list(text):
    """Codes and words of a list: dict of str to str."""
    entries = (entry.strip() for line in text.splitlines() for entry in line.split("|"))
    return dict(entry.split(" ", 1) for entry in entries if entry)
