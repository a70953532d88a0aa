; Helpers of the feature robot_memory: facts as documents, and trigger events.

(deftemplate robmem-trigger
  "The robot memory changed. Such a fact stays for the run in which it came."
  (slot ptr (type EXTERNAL-ADDRESS))        ; document of the change stream
  (slot name (type STRING))                 ; as given at registration
  (multislot rcvd-at (type INTEGER)         ; system time
                     (cardinality 2 2))
)

(deffunction rm-field-name (?slot)
  "Internal. Name of a document's field for a slot: the first dash becomes an
   underscore, and only the first."
  (bind ?dash (str-index "-" ?slot))
  (if (not ?dash) then (return (str-cat ?slot)))
  (return (str-cat (sub-string 1 (- ?dash 1) ?slot) "_"
                   (sub-string (+ ?dash 1) (str-length ?slot) ?slot)))
)

(deffunction rm-structured-fact-to-bson (?fact $?relation)
  "Document with the slots of a fact, and as `relation` its template, unless
   ?relation names another. To be destroyed by the caller."
  (bind ?template (fact-relation ?fact))
  (bind ?doc (bson-create))
  (bson-append ?doc "relation" (if (= 0 (length$ ?relation))
                                then ?template else (sym-cat (nth$ 1 ?relation))))
  (progn$ (?slot (fact-slot-names ?fact))
    (bind ?value (fact-slot-value ?fact ?slot))
    (if (deftemplate-slot-multip ?template ?slot)
     then (bson-append-array ?doc (rm-field-name ?slot) ?value)
     else (bson-append ?doc (rm-field-name ?slot) ?value))
  )
  (return ?doc)
)

(deffunction rm-ordered-fact-to-bson (?fact)
  "Document with the `relation` and the `values` of an ordered fact. To be
   destroyed by the caller."
  (bind ?doc (bson-create))
  (bson-append ?doc "relation" (fact-relation ?fact))
  (bson-append-array ?doc "values" (fact-slot-value ?fact implied))
  (return ?doc)
)

(deffunction rm-has-slots (?relation)
  "Internal. TRUE if there is a template of that name whose facts are not ordered."
  (return (and (member$ ?relation (get-deftemplate-list MAIN))
               (neq (create$ implied) (create$ (deftemplate-slot-names ?relation)))))
)

(deffunction rm-slot-text (?template ?doc ?field)
  "Internal. A slot as it is written in a fact; empty if the template lacks it."
  (bind ?slot (sym-cat ?field))
  (if (not (deftemplate-slot-existp ?template ?slot)) then (return ""))
  (if (not (deftemplate-slot-multip ?template ?slot)) then
    (return (str-cat "(" ?slot " " (bson-get ?doc ?field) ")")))
  (bind ?symbols (create$))
  (progn$ (?value (bson-get-array ?doc ?field))
    (bind ?symbols (create$ ?symbols (sym-cat ?value)))
  )
  (return (str-cat "(" ?slot " " (implode$ ?symbols) ")"))
)

(deffunction rm-assert-from-bson (?doc)
  "Assert the fact of which the document tells. Its relation is a template, or
   that of an ordered fact. Returns the fact; without a relation, an error
   message is printed."
  (if (not (bson-has-field ?doc "relation")) then
    (printout error "Can not create fact from " (bson-tostring ?doc) crlf)
    (return FALSE))
  (bind ?relation (sym-cat (bson-get ?doc "relation")))
  (bind ?text "")
  (if (rm-has-slots ?relation)
   then
    (progn$ (?field (bson-field-names ?doc))
      (bind ?text (str-cat ?text (rm-slot-text ?relation ?doc ?field)))
    )
   else
    (if (bson-has-field ?doc "values") then
      (bind ?text (implode$ (bson-get-array ?doc "values")))))
  (return (cx-assert-data (str-cat "(" ?relation " " ?text ")")))
)

(defrule rm-cleanup-trigger-facts
  "Nobody wanted the event."
  (declare (salience -4000))
  ?event <- (robmem-trigger (ptr ?doc))
  =>
  (bson-destroy ?doc)
  (retract ?event)
)
