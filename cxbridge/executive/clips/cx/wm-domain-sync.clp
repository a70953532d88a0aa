; Synchronises the world model (wm-fact) and the domain model (domain-fact,
; domain-object) in both directions. The rules that synchronise, with the templates
; wm-sync-pair and wm-sync-atom, are in wm-domain-sync-facts.clp and
; wm-domain-sync-objects.clp.
;
; A domain-fact of a declared predicate corresponds to a wm-fact with the key
; `domain fact NAME args? PARAM VALUE ...`, or with another path from a
; wm-sync-remap-fact. The domain-objects of a type correspond to a wm-fact with the
; key `domain objects-by-type TYPE`, a list.
;
; Changes. A pair of facts keeps its state at the last synchronisation; the side
; that differs from this state has changed, and the other side follows. The state
; has the fact indexes (in wm-sync-map-fact) and the value of the wm-fact (in
; wm-sync-pair), because some modifications give the fact a new index and others
; do not.
;
; Speed. No rule compares a fact with all others. CLIPS hashes joins on single
; fields, but not on multifields or function calls. So each domain-fact gets a
; wm-sync-atom with the parameter values as a text, and all rules join on this
; text, the name and the ID.
;
; Saliences: names are indexed at WM-IDKEY, facts are deleted at WM-SYNC-DEL and
; added at WM-SYNC-ADD.
;
; Needs saliences.clp, domain.clp, worldmodel.clp. Templates, rules and functions that are not internal
; have Fawkes' names.

; *** Templates of facts ***

(deftemplate wm-sync-map-fact
  "A synchronised pair of a wm-fact and a domain-fact, and the state of both."
  ; --- the wm-fact; index 0: there is no wm-fact
  (slot wm-fact-id (type STRING))
  (multislot wm-fact-key (type SYMBOL))
  (slot wm-fact-idx (type INTEGER))
  ; --- whether the wm-fact is retracted with the domain-fact, or else becomes FALSE
  (slot wm-fact-retract (type SYMBOL)
                        (allowed-values TRUE FALSE)
                        (default TRUE))
  ; --- the domain-fact; index 0: there is no domain-fact
  (slot domain-fact-name (type SYMBOL))
  (slot domain-fact-idx (type INTEGER))
)

(deftemplate wm-sync-remap-fact
  "Another path for the wm-facts of a predicate, for example `hardware gripper grasped`
   for the predicate holding. The arguments must have the names of the predicate's
   parameters. Assert this fact before the facts of the predicate."
  (slot domain-fact-name (type SYMBOL))
  (multislot wm-fact-key-path (type SYMBOL))
)

; *** Templates of objects ***

(deftemplate wm-sync-map-object-type
  "The wm-fact that lists the objects of a type."
  (slot domain-object-type (type SYMBOL))
  ; --- the wm-fact; index 0 before the first synchronisation
  (slot wm-fact-id (type STRING))
  (slot wm-fact-idx (type INTEGER))
  (multislot wm-fact-key (type SYMBOL))
)

(deftemplate wm-sync-remap-object-type
  "Another key for the list of a type's objects. Assert this fact before the type."
  (multislot wm-fact-key (type SYMBOL))
  (slot domain-object-type (type SYMBOL))
)

; *** Settings ***

(deffunction wm-sync-remap-fact-id-prefix ($?id-paths)
  "Map predicates to the IDs ?id-paths, whose last part is the predicate.
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
  "Map object types to the IDs ?id-paths, whose last part is the type."
  (progn$ (?id ?id-paths)
    (bind ?key (wm-id-to-key ?id))
    (assert (wm-sync-remap-object-type (wm-fact-key ?key)
                                       (domain-object-type (nth$ (length$ ?key) ?key))))
  )
)

(deffunction wm-sync-set-wm-fact-retract (?id ?enabled)
  "Choose the effect of the retraction of a domain-fact on its wm-fact ?id: with
   ?enabled TRUE, the default, the wm-fact is retracted; with FALSE, its value becomes
   FALSE. Without effect if the wm-fact is not synchronised."
  (do-for-fact ((?map wm-sync-map-fact)) (eq ?id ?map:wm-fact-id)
    (modify ?map (wm-fact-retract ?enabled))
  )
)

; *** Keys and parameters ***
; The rules need only wm-sync-key-arg-values and wm-sync-remapped-path-match; the other functions are for
; agents, as in Fawkes.

(deffunction wm-sync-key-arg-values ($?key)
  "The argument values of a key in the order of the key; FALSE and an error message
   for a list, which domain-facts cannot have."
  (bind ?mark (member$ args? ?key))
  (bind ?values (create$))
  (if ?mark then
    (loop-for-count (?pair 1 (div (- (length$ ?key) ?mark) 2)) do
      (bind ?value-idx (+ ?mark (* 2 ?pair)))
      (bind ?value (nth$ ?value-idx ?key))
      ; as in Fawkes, an opening bracket at the end of the key is a plain value
      (if (and (eq ?value [) (< ?value-idx (length$ ?key))) then
        (printout error "Domain predicates may not contain argument value list "
                        ?key crlf)
        (return FALSE))
      (bind ?values (create$ ?values ?value))))
  (return ?values)
)

(deffunction wm-sync-next-arg (?idx $?key)
  "The index of the argument name after the name at ?idx; that of the first name if
   ?idx is 0. 0 at the end; -1 and an error message if the first argument is a list
   (as in Fawkes, later arguments are not checked)."
  (bind ?length (length$ ?key))
  (bind ?next (+ ?idx 2))
  (if (= ?idx 0) then
    (bind ?mark (member$ args? ?key))
    (if (not ?mark) then (return 0))
    (bind ?next (+ ?mark 1)))
  (if (>= ?next ?length) then (return 0))
  (if (and (= ?idx 0) (eq [ (nth$ (+ ?next 1) ?key))) then
    (printout error "Domain facts may not contain argument value list " ?key crlf)
    (return -1))
  (return ?next)
)

(deffunction wm-sync-args-match (?key ?param-names ?param-values)
  "TRUE if the arguments of the key are the parameters ?param-names with the values
   ?param-values, in any order."
  (bind ?matched 0)
  (bind ?name-idx (wm-sync-next-arg 0 ?key))
  (while (> ?name-idx 0) do
    (bind ?position (member$ (nth$ ?name-idx ?key) ?param-names))
    (if (or (not ?position) (neq (nth$ ?position ?param-values) (nth$ (+ ?name-idx 1) ?key))) then
      (return FALSE))
    (bind ?matched (+ ?matched 1))
    (bind ?name-idx (wm-sync-next-arg ?name-idx ?key))
  )
  (return (and (= ?name-idx 0) (>= ?matched (length$ ?param-names))))
)

(deffunction wm-sync-remapped-path-match (?key ?key-path)
  "TRUE if ?key-path is the path of the key."
  (return (eq ?key-path (wm-key-path ?key)))
)

(deffunction wm-sync-remapped-pathargs-match (?key ?key-path ?param-names ?param-values)
  "TRUE if ?key-path is the path of the key, and the arguments match (wm-sync-args-match)."
  (return (and (wm-sync-remapped-path-match ?key ?key-path)
               (wm-sync-args-match ?key ?param-names ?param-values)))
)

; *** Remapping from the configuration ***
; The salience is above that of the first addition, so that no fact is synchronised without its remapping.

(deffunction wm-sync-config-prefix (?spec ?section)
  "Internal. The configuration path of a spec's remapping of ?section: facts, objects, or one of
   these with a further path element."
  (return (str-cat "/clips-executive/specs/" ?spec "/wm-remap/" ?section "/"))
)

(deffunction wm-sync-config-name (?path ?prefix)
  "Internal. The rest of ?path after ?prefix; FALSE if ?path has another prefix."
  (if (neq 1 (str-index ?prefix ?path)) then (return FALSE))
  (return (sym-cat (sub-string (+ 1 (str-length ?prefix)) (str-length ?path) ?path)))
)

(defrule wm-sync-config-remap-fact-id-prefix
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?confval <- (confval (type STRING) (is-list TRUE) (list-value $?ids)
                       (path ?path&:(eq ?path (str-cat (wm-sync-config-prefix ?spec facts)
                                                       "id-prefix"))))
  =>
  (wm-sync-remap-fact-id-prefix ?ids)
  (retract ?confval)
)

(defrule wm-sync-config-remap-fact-name-id
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?confval <- (confval (type STRING) (is-list FALSE) (value ?id)
                       (path ?path&:(wm-sync-config-name
                                      ?path (wm-sync-config-prefix ?spec "facts/name-id"))))
  =>
  (bind ?name (wm-sync-config-name ?path (wm-sync-config-prefix ?spec "facts/name-id")))
  (assert (wm-sync-remap-fact (domain-fact-name ?name)
                              (wm-fact-key-path (wm-id-to-key ?id))))
  (retract ?confval)
)

(defrule wm-sync-config-remap-object-id-prefix
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?confval <- (confval (type STRING) (is-list TRUE) (list-value $?ids)
                       (path ?path&:(eq ?path (str-cat (wm-sync-config-prefix ?spec objects)
                                                       "id-prefix"))))
  =>
  (wm-sync-remap-object-id-prefix ?ids)
  (retract ?confval)
)

(defrule wm-sync-config-remap-object-name-id
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?confval <- (confval (type STRING) (is-list FALSE) (value ?id)
                       (path ?path&:(wm-sync-config-name
                                      ?path (wm-sync-config-prefix ?spec "objects/name-id"))))
  =>
  (bind ?type (wm-sync-config-name ?path (wm-sync-config-prefix ?spec "objects/name-id")))
  (assert (wm-sync-remap-object-type (domain-object-type ?type)
                                     (wm-fact-key (wm-id-to-key ?id))))
  (retract ?confval)
)
