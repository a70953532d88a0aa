; Keeps the world model (wm-fact) and the domain model (domain-fact,
; domain-object) the same, in both directions.
;
; A domain-fact of a declared predicate corresponds to a wm-fact with the key
; `domain fact NAME args? PARAM VALUE ...`, or to one below another path where a
; wm-sync-remap-fact says so. The domain-objects of a type correspond to a
; wm-fact with the key `domain objects-by-type TYPE`, a list.
;
; How a change is noticed. For each pair the state at the last synchronisation
; is kept, and the side that differs from it has changed and wins. Both the fact
; indexes (in wm-sync-map-fact) and the value of the wm-fact (in wm-sync-pair)
; are kept: a modify may give the fact a new index or may leave the index alone,
; according to who did it; either is a change.
;
; How it stays fast. Nothing compares one fact with all others. CLIPS looks up
; joins over single fields in hash tables, but not those over multifields or
; over function calls; hence each domain-fact gets a wm-sync-atom, which has the
; parameter values as one text, and all rules join over that text, the name and
; the ID.
;
; Order: names are noted at WM-IDKEY, deletions made at WM-SYNC-DEL, additions
; at WM-SYNC-ADD.
;
; Needs saliences.clp, domain.clp, worldmodel.clp.

; *** What is known of facts ***

(deftemplate wm-sync-map-fact
  "A wm-fact and a domain-fact that are kept the same, and the state of both."
  ; --- world model side: index 0 means that there is no fact
  (slot wm-fact-id (type STRING))
  (multislot wm-fact-key (type SYMBOL))
  (slot wm-fact-idx (type INTEGER))
  ; --- when the domain-fact goes: retract the wm-fact, or set its value FALSE?
  (slot wm-fact-retract (type SYMBOL)
                        (allowed-values TRUE FALSE)
                        (default TRUE))
  ; --- domain side: index 0 means that there is no fact
  (slot domain-fact-name (type SYMBOL))
  (slot domain-fact-idx (type INTEGER))
)

(deftemplate wm-sync-remap-fact
  "The facts of a predicate go by another path in the world model, for example
   `hardware gripper grasped` for the predicate holding. The arguments must have
   the names of the predicate's parameters. To be asserted before the facts."
  (slot domain-fact-name (type SYMBOL))
  (multislot wm-fact-key-path (type SYMBOL))
)

; *** What is known of objects ***

(deftemplate wm-sync-map-object-type
  "The wm-fact that lists the objects of one type."
  (slot domain-object-type (type SYMBOL))
  ; --- the wm-fact; index 0 before the first synchronisation
  (slot wm-fact-id (type STRING))
  (slot wm-fact-idx (type INTEGER))
  (multislot wm-fact-key (type SYMBOL))
)

(deftemplate wm-sync-remap-object-type
  "The list of a type's objects has another key. To be asserted before the type."
  (multislot wm-fact-key (type SYMBOL))
  (slot domain-object-type (type SYMBOL))
)

; *** Settings ***

(deffunction wm-sync-remap-fact-id-prefix ($?id-paths)
  "Map predicates to the IDs ?id-paths; the last part of an ID is the predicate.
   Example: (wm-sync-remap-fact-id-prefix \"/wm/holding\") for predicate holding.
   An ID with arguments is refused with an error message."
  (progn$ (?id ?id-paths)
    (bind ?key (wm-id-to-key ?id))
    (if (member$ args? ?key)
     then (printout error "Cannot remap ID prefix with arguments (" ?id ")" crlf)
     else (assert (wm-sync-remap-fact (wm-fact-key-path ?key)
                                      (domain-fact-name (nth$ (length$ ?key) ?key))))
    )
  )
)

(deffunction wm-sync-remap-object-id-prefix ($?id-paths)
  "Map object types to the IDs ?id-paths; the last part of an ID is the type."
  (progn$ (?id ?id-paths)
    (bind ?key (wm-id-to-key ?id))
    (assert (wm-sync-remap-object-type (wm-fact-key ?key)
                                       (domain-object-type (nth$ (length$ ?key) ?key))))
  )
)

(deffunction wm-sync-set-wm-fact-retract (?id ?enabled)
  "What happens to the wm-fact ?id when its domain-fact goes: it is retracted if
   ?enabled is TRUE, as is the rule; its value becomes FALSE otherwise."
  (do-for-fact ((?map wm-sync-map-fact)) (eq ?id ?map:wm-fact-id)
    (modify ?map (wm-fact-retract ?enabled))
  )
)

; *** Keys and parameters ***

(deffunction wm-sync-key-arg-values ($?key)
  "Argument values of a key in the key's order; FALSE and an error message if
   one of them is a list, which domain-facts cannot have."
  (bind ?mark (member$ args? ?key))
  (bind ?values (create$))
  (if ?mark then
    (loop-for-count (?i 1 (div (- (length$ ?key) ?mark) 2)) do
      (bind ?l (+ ?mark (* 2 ?i)))
      (bind ?value (nth$ ?l ?key))
      (if (and (eq ?value [) (< ?l (length$ ?key))) then
        (printout error "Domain predicates may not contain argument value list "
                        ?key crlf)
        (return FALSE))
      (bind ?values (create$ ?values ?value))))
  (return ?values)
)

(deffunction wm-sync-next-arg (?idx $?key)
  "Index of the argument name behind the one at ?idx, of the first one if ?idx
   is 0. Returns 0 at the end, -1 and an error message if the first is a list."
  (bind ?L (length$ ?key))
  (bind ?next (+ ?idx 2))
  (if (= ?idx 0) then
    (bind ?mark (member$ args? ?key))
    (if (not ?mark) then (return 0))
    (bind ?next (+ ?mark 1)))
  (if (>= ?next ?L) then (return 0))
  (if (and (= ?idx 0) (eq [ (nth$ (+ ?next 1) ?key))) then
    (printout error "Domain facts may not contain argument value list " ?key crlf)
    (return -1))
  (return ?next)
)

(deffunction wm-sync-args-match (?key ?param-names ?param-values)
  "TRUE if the key names each of the parameters, in any order, with its value,
   and nothing else."
  (bind ?matched 0)
  (bind ?l (wm-sync-next-arg 0 ?key))
  (while (> ?l 0) do
    (bind ?at (member$ (nth$ ?l ?key) ?param-names))
    (if (or (not ?at) (neq (nth$ ?at ?param-values) (nth$ (+ ?l 1) ?key))) then
      (return FALSE))
    (bind ?matched (+ ?matched 1))
    (bind ?l (wm-sync-next-arg ?l ?key))
  )
  (return (and (= ?l 0) (>= ?matched (length$ ?param-names))))
)

(deffunction wm-sync-remapped-path-match (?key ?key-path)
  "TRUE if ?key-path is the whole path of the key."
  (return (eq ?key-path (wm-key-path ?key)))
)

(deffunction wm-sync-remapped-pathargs-match (?key ?key-path ?param-names ?param-values)
  "TRUE if both the path and the arguments of the key are the given ones."
  (return (and (wm-sync-remapped-path-match ?key ?key-path)
               (wm-sync-args-match ?key ?param-names ?param-values)))
)

; *** Remapping from the configuration ***
; Before the first addition, so that no fact is synchronised unmapped.

(deffunction wm-sync-config-prefix (?spec ?what)
  "Internal. Configuration path below which a spec has its remapping of ?what."
  (return (str-cat "/clips-executive/specs/" ?spec "/wm-remap/" ?what "/"))
)

(deffunction wm-sync-config-name (?path ?prefix)
  "Internal. What stands behind ?prefix in ?path, FALSE if it does not start so."
  (if (neq 1 (str-index ?prefix ?path)) then (return FALSE))
  (return (sym-cat (sub-string (+ 1 (str-length ?prefix)) (str-length ?path) ?path)))
)

(defrule wm-sync-config-remap-fact-id-prefix
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?cf <- (confval (type STRING) (is-list TRUE) (list-value $?ids)
                  (path ?path&:(eq ?path (str-cat (wm-sync-config-prefix ?spec facts)
                                                  "id-prefix"))))
  =>
  (wm-sync-remap-fact-id-prefix ?ids)
  (retract ?cf)
)

(defrule wm-sync-config-remap-fact-name-id
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?cf <- (confval (type STRING) (is-list FALSE) (value ?id)
                  (path ?path&:(wm-sync-config-name
                                 ?path (wm-sync-config-prefix ?spec "facts/name-id"))))
  =>
  (bind ?name (wm-sync-config-name ?path (wm-sync-config-prefix ?spec "facts/name-id")))
  (assert (wm-sync-remap-fact (domain-fact-name ?name)
                              (wm-fact-key-path (wm-id-to-key ?id))))
  (retract ?cf)
)

(defrule wm-sync-config-remap-object-id-prefix
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?cf <- (confval (type STRING) (is-list TRUE) (list-value $?ids)
                  (path ?path&:(eq ?path (str-cat (wm-sync-config-prefix ?spec objects)
                                                  "id-prefix"))))
  =>
  (wm-sync-remap-object-id-prefix ?ids)
  (retract ?cf)
)

(defrule wm-sync-config-remap-object-name-id
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?cf <- (confval (type STRING) (is-list FALSE) (value ?id)
                  (path ?path&:(wm-sync-config-name
                                 ?path (wm-sync-config-prefix ?spec "objects/name-id"))))
  =>
  (bind ?type (wm-sync-config-name ?path (wm-sync-config-prefix ?spec "objects/name-id")))
  (assert (wm-sync-remap-object-type (domain-object-type ?type)
                                     (wm-fact-key (wm-id-to-key ?id))))
  (retract ?cf)
)
